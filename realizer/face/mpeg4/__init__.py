"""MPEG-4 facial animation on any head: zones of influence in, displacement fields out; and their truth."""

from realizer.face.mpeg4.build import apply_zones, setup_of
from realizer.face.mpeg4.defaults import default_setup
from realizer.face.mpeg4.faceeditor import fitted, read_faceeditor, write_faceeditor
from realizer.face.mpeg4.fields import zone_fields
from realizer.face.mpeg4.landmarks import find_points
from realizer.face.mpeg4.parameters import read_setup, write_setup
from realizer.face.mpeg4.truth import PEERS, Truth, face_truth, mean_score
from realizer.face.mpeg4.zones import Setup, Zone, synchronised

__all__ = [
    "PEERS",
    "Setup",
    "Truth",
    "Zone",
    "apply_zones",
    "default_setup",
    "face_truth",
    "find_points",
    "fitted",
    "mean_score",
    "read_faceeditor",
    "read_setup",
    "setup_of",
    "synchronised",
    "write_faceeditor",
    "write_setup",
    "zone_fields",
]
