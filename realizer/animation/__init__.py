"""Curves to frames: channels of AUs and FAPs are sampled, blended and mapped."""
