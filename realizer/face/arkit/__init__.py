"""Bring your own head: a GLB with ARKit's morph targets in, a face folder out."""

from realizer.face.arkit.folder import Report, import_head, look_at
from realizer.face.arkit.names import canonical, shapes

__all__ = ["Report", "canonical", "import_head", "look_at", "shapes"]
