"""Pictures of our faces, as a camera would take them, with the true places of their feature points."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec

import numpy as np
import pytest
from PIL import Image

from realizer.animation.axis import au, axis
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames
from realizer.face.deform import deform
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import load_face
from realizer.render.cameras import camera_for
from tests.pictures import drawn_here

__all__ = ["LITERT", "faps_of", "pixels_of", "portrait"]

SIZE = (320, 320)
LITERT = pytest.mark.skipif(find_spec("ai_edge_litert") is None, reason="needs the track extra")


def faps_of(face: str, **units: float) -> np.ndarray:
    """Return the FAPs (68,) of action units: faps_of("ada", AU12=0.8)."""
    row = np.zeros((1, len(axis())), np.float32)
    for name, value in units.items():
        for target in au(int(name[2:])):
            row[0, target.column] = value
    return to_fap(AUFrames(np.zeros(1), row), mapping_of(face)).values[0]


@cache
def _drawn(face: str, faps: bytes) -> np.ndarray:
    return drawn_here(face, SIZE, np.frombuffer(faps, np.float32)[None], backend="onboard")[0]


def portrait(face: str = "ada", faps: np.ndarray | None = None) -> Image.Image:
    """Return a picture of a face."""
    row = np.zeros(68, np.float32) if faps is None else np.asarray(faps, np.float32)
    return Image.fromarray(_drawn(face, row.tobytes()))


def pixels_of(name: str, faps: np.ndarray | None = None) -> dict[str, np.ndarray]:
    """Return the places (2,) in the picture of a face's feature points."""
    face = load_face(name)
    row = np.zeros(68, np.float32) if faps is None else faps
    at, _ = camera_for(face).project(deform(face, row[None])[0], SIZE)
    return {point: at[index] for point, index in face.feature_points.items()}
