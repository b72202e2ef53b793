"""Phonemes to lip, jaw and tongue channels."""
