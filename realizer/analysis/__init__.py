"""Recordings and pictures of faces to FAPs, emotions and expressions."""

__all__: list[str] = []
