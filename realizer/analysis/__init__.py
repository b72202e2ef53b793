"""Recordings and pictures of faces to FAPs, emotions and expressions."""
