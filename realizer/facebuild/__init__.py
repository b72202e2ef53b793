"""Making face folders; nothing that runs imports this package."""

__all__: list[str] = []
