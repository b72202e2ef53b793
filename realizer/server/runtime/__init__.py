"""Sessions inside event loops and processes."""

__all__: list[str] = []
