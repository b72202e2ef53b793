"""Phonemes to lip, jaw and tongue channels."""

__all__: list[str] = []
