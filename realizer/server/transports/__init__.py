"""Transports: WebSocket, Xface, Asap, STOMP, VMC and Live Link, all leading into the same sessions."""
