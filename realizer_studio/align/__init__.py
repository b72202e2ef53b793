"""Alignment of recordings with their text."""
