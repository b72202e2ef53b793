"""Sync point scheduling by weighted least squares."""

from realizer.scheduling.problem import Member
from realizer.scheduling.rigid_clusters import warm_up
from realizer.scheduling.schedule_block import schedule_together
from realizer.scheduling.timing import Schedule, Timing, Warning

__all__ = ["Member", "Schedule", "Timing", "Warning", "schedule_together", "warm_up"]
