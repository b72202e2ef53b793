"""gesture, pointing, posture, postureShift, locomotion: timed and reported, not shown on a face."""

from __future__ import annotations

from bml_schema import Gesture, Locomotion, Pointing, Posture, PostureShift
from realizer.behaviours.kind import BehaviourKind
from realizer.behaviours.table_timing import table_timing

KINDS = (
    BehaviourKind(Gesture, table_timing("gesture")),
    BehaviourKind(Pointing, table_timing("pointing")),
    BehaviourKind(Posture, table_timing("posture")),
    BehaviourKind(PostureShift, table_timing("postureShift")),
    BehaviourKind(Locomotion, table_timing("locomotion")),
)
