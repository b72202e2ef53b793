"""Speech from recordings and clips."""

__all__: list[str] = []
