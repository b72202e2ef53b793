"""Sync points by least squares: a block's timings in, its sync times out."""

from realizer.scheduling.plan import schedule_block
from realizer.scheduling.timing import Schedule, Timing, Warning

__all__ = ["Schedule", "Timing", "Warning", "schedule_block"]
