"""Fitting of the face model by action units."""
