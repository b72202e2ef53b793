"""Fitting the action unit model of a face."""
