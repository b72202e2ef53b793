"""Involuntary motion: blinks, small head motion, saccades, motion that accompanies speech."""
