"""Fitting the action unit model of a face."""

__all__: list[str] = []
