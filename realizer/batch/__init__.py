"""Batch realization: many documents to outputs and a manifest; done work is not repeated."""
