"""Sampling, blending and mapping of the channels of AUs and FAPs."""
