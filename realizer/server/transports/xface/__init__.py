"""The Xface transports: TCP server and player client."""

__all__: list[str] = []
