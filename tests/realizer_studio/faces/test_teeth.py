"""Tests of generated teeth with gums and palate, and of what an open mouth shows."""

import numpy as np
import pytest

from realizer.face.deform import deform
from realizer.face.load import list_faces, load_face
from realizer.face.model import Face
from realizer.face.surface import normals
from realizer.render.cameras import camera_for
from realizer.render.light import preset
from realizer.render.raster import SoftwareCanvas
from realizer_studio.faces.teeth import PALATE, RINGS, teeth

COLOURS = {"tooth": [240.0, 232, 214], "root": [228.0, 206, 180], "gum": [196.0, 112, 106]}
WIDE = {3: 1100, 4: -80, 5: -1535, 10: -1245, 11: -1245, 52: -1525, 57: -1315, 58: -1315, 12: -480, 13: -480}


def opened(face: Face) -> np.ndarray:
    """(n_vertices, 3): a mouth as wide as AU27 and AU25 open it."""
    pose = np.zeros((1, 68), np.float32)
    for fap, value in WIDE.items():
        pose[0, fap - 1] = value
    shape: np.ndarray = deform(face, pose)[0]
    return shape


@pytest.mark.parametrize("name", ["upper_teeth", "lower_teeth"])
def test_teeth_are_closed_towards_the_tongue(name: str) -> None:
    arch = teeth(name, np.zeros(3), 0.021, 0.030, COLOURS)
    a, b, c = (arch.vertices[arch.triangles[:, k]] for k in range(3))
    ups = np.cross(b - a, c - a)
    middle = (np.abs(a[:, 0]) < 0.008) & (a[:, 2] > -0.008)
    assert (ups[middle, 2] > 0).any()  # those that face the lips
    assert (ups[middle, 2] < 0).any()  # and those that face the tongue
    rings = len(RINGS) + (len(PALATE) if name == "upper_teeth" else 0)
    rows = arch.vertices.reshape(-1, rings, 3)
    tongue, lips = rows[:, -len(RINGS)], rows[:, -1]
    front = lips[:, 2] > -0.010
    assert (tongue[front, 2] < lips[front, 2]).all()


def test_teeth_of_the_upper_jaw_have_a_palate_above_the_crowns() -> None:
    upper, lower = (teeth(f"{row}_teeth", np.zeros(3), 0.021, 0.030, COLOURS) for row in ("upper", "lower"))
    middle = np.hypot(upper.vertices[:, 0], upper.vertices[:, 2] + 0.030) < 0.010
    assert middle.any()
    assert upper.vertices[middle, 1].min() > 0.010
    assert not (np.hypot(lower.vertices[:, 0], lower.vertices[:, 2] + 0.030) < 0.010).any()


def test_teeth_are_mirror_images_and_their_gums_cover_the_gaps() -> None:
    arch = teeth("upper_teeth", np.zeros(3), 0.021, 0.030, COLOURS)
    rows = arch.vertices.reshape(-1, len(RINGS) + len(PALATE), 3)
    assert np.allclose(rows[::-1] * [-1, 1, 1], rows, atol=1e-9)
    gum = rows[:, -3, 1]
    middle = len(rows) // 2  # the gap between the two front teeth
    assert gum[middle] < gum[middle + 2] - 0.001


@pytest.mark.parametrize("name", [info.name for info in list_faces()])
@pytest.mark.slow
def test_parts_of_an_open_mouth_are_dark_red_not_black(name: str) -> None:
    face = load_face(name)
    shape = opened(face)
    camera = camera_for(face, "three-quarter")
    canvas = SoftwareCanvas(face, (512, 512), camera, preset("portrait"))
    picture = canvas.draw(shape, normals(face, shape[None])[0]).astype(float)
    canvas.close()
    upper, lower = camera.project(
        shape[[face.feature_points["2.2"], face.feature_points["2.3"]]], (512, 512)
    )[0]
    for share in (0.4, 0.5, 0.6):
        x, y = np.rint(upper + share * (lower - upper)).astype(int)
        red, green, blue = picture[y - 1 : y + 2, x - 1 : x + 2].mean(axis=(0, 1))
        assert 36 < red < 140, share
        assert red > 1.6 * green, share
        assert abs(green - blue) < 15, share


@pytest.mark.parametrize("name", [info.name for info in list_faces()])
def test_tongue_sinks_less_than_the_jaw_and_stays_behind(name: str) -> None:
    face = load_face(name)
    shape = opened(face)
    fall = face.vertices[:, 1] - shape[:, 1]
    tip, edge = face.feature_points["6.1"], face.feature_points["9.11"]
    assert 0.004 < fall[tip] < 0.9 * fall[edge]
    assert shape[tip, 2] < shape[edge, 2]
