"""Emotions: words and places on the emotion wheel, and the FAP profiles that show them."""
