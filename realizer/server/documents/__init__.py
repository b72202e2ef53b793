"""Documents between their arrival and their planning."""

__all__: list[str] = []
