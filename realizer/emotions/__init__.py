"""Emotions: words and places on the wheel, and the FAP profiles that show them."""
