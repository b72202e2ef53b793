"""Checking of documents: faults with explanations, and advice."""
