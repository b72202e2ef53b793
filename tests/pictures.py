"""Pictures drawn in the process of the test: a drawing process takes seconds of processor time to start."""

from __future__ import annotations

from typing import Any

import numpy as np

from realizer.core.array_types import Float32, UInt8
from realizer.face.deform import complete_poses
from realizer.face.load import load_face
from realizer.render.cameras import camera_for
from realizer.render.light import preset
from realizer.render.worker import open_canvas, shapes

__all__ = ["drawn_here"]


def drawn_here(
    name: str,
    size: tuple[int, int],
    poses: Float32,
    camera: str = "front",
    light: str | None = None,
    **options: Any,
) -> UInt8:
    """Return what `Renderer.draw` returns; `options` are `background` and `backend`."""
    face = load_face(name)
    _, canvas = open_canvas(face, size, camera_for(face, camera), preset(light), **options)
    try:
        rows = complete_poses(poses, face.inputs)
        return np.stack([canvas.draw(*shape).copy() for shape in shapes(face, rows)])
    finally:
        canvas.close()
