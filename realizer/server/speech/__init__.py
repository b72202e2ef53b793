"""Speech that clients send piece by piece, and their sound clips."""

__all__: list[str] = []
