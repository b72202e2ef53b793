"""Transports: WebSocket, Xface, Asap and STOMP, all leading into the same sessions."""
