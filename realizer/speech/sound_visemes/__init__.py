"""Phonemes from sound alone, as far as the lips show them."""
