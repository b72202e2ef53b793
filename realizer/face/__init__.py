"""Heads that FAPs and action units move: a face folder in, vertices out."""
