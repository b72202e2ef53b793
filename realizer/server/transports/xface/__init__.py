"""The Xface transports: TCP server and player client."""
