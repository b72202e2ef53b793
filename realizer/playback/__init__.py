"""Blocks that live in time: planned, composed, started, moved, sampled and reported."""
