"""Checks of documents: explanations of faults, and advice."""
