"""The head of a shipped face, to grow hair on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from realizer.face.load import load_face
from realizer.face.mesh_geometry import part_triangles
from realizer.face.model import Face
from realizer_studio.faces.hair.facial_hair import Margin
from realizer_studio.faces.hair.style import Style, style_of
from realizer_studio.faces.person.scalp import Scalp


@pytest.fixture(scope="session")
def head() -> Face:
    return replace(load_face("ada"), cards=None)


@pytest.fixture(scope="session")
def skin(head: Face) -> tuple[np.ndarray, np.ndarray]:
    """Places (n, 3) and triangles of the skin."""
    first, last = head.parts["skin"]
    return head.vertices[first:last].astype(float), part_triangles(head.triangles, (first, last))


@pytest.fixture(scope="session")
def points(head: Face) -> dict[str, np.ndarray]:
    return {name: np.array(place, float) for name, place in head.points.items()}


@pytest.fixture(scope="session")
def style() -> Style:
    """Short hair of few cards."""
    return style_of({"style": "short", "cards": 40, "border": 20})


@pytest.fixture(scope="session")
def scalp(skin: tuple[np.ndarray, np.ndarray], points: dict[str, np.ndarray], style: Style) -> Scalp:
    return Scalp(*skin, points, style.line, style.rise)


@pytest.fixture(scope="session")
def margin(head: Face) -> Margin:
    """The upper edge of the left lid, as far as feature points know it."""
    edge = [head.feature_points[name] for name in ("3.11", "3.1", "3.7")]
    centre = np.array(head.points["3.5"], float) - [0, 0, 0.012]
    return Margin(edge, [head.feature_points["4.3"]], True, centre)
