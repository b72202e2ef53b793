"""Batch realization: outputs and a manifest of many documents; a later run skips what is done."""
