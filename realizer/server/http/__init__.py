"""The service over HTTP: page, tools, access control, metrics."""

__all__: list[str] = []
