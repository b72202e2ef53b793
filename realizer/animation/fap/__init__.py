"""MPEG-4 FAP frames: from action units, from files."""

__all__: list[str] = []
