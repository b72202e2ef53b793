"""Frames, sound, pictures and schedules for subscribers."""
