"""Utterances from recordings."""
