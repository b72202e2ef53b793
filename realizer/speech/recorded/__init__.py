"""Utterances from recordings and clips."""
