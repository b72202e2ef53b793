"""Frames, sound, pictures and schedules for subscribers."""

__all__: list[str] = []
