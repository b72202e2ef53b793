"""Involuntary motion: blinks, small head motion, saccades, and motion that accompanies speech."""
