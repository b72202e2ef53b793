"""A face of one triangle, to test whether drawing works."""

from __future__ import annotations

import numpy as np

from realizer.face.model import Face, Fapu


def triangle() -> Face:
    """Return a face of three vertices from chin to hairline that knows no FAP."""
    vertices = np.array([[-0.08, -0.12, 0], [0.08, -0.12, 0], [0, 0.06, 0]], np.float32)
    return Face(
        name="triangle",
        source="",
        licence="",
        vertices=vertices,
        triangles=np.array([[0, 1, 2]], np.int32),
        colours=np.full((3, 3), 200, np.uint8),
        occlusion=np.ones(3, np.float32),
        gloss=np.zeros(3, np.float32),
        parts={"skin": (0, 3)},
        feature_points={"2.1": 0, "11.1": 2},
        points={"2.1": np.array([0, -0.12, 0], np.float32), "11.1": vertices[2]},
        fapu=Fapu(0.012, 0.064, 0.05, 0.03, 0.05),
        basis={},
    )
