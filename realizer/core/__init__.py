"""Values and settings that every layer shares."""

__all__: list[str] = []
