"""MPEG-4 facial animation on any head: zones of influence in, displacement fields out; and their truth."""

from realizer.face.mpeg4.truth import PEERS, Truth, face_truth, mean_score

__all__ = ["PEERS", "Truth", "face_truth", "mean_score"]
