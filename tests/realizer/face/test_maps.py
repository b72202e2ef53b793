"""`read_maps`: pictures beside the mesh, or one sentence on what is wrong with them."""

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer.face.maps import read_maps

MESH = {
    "vertices": np.zeros((4, 3)),
    "triangles": np.zeros((2, 3)),
    "uv": np.full((2, 3, 2), 65535, np.uint16),
    "fold_weights": np.full((4, 2), 255, np.uint8),
}


@pytest.fixture
def folder(tmp_path):
    for name in ("albedo", "relief"):
        (tmp_path / f"{name}.webp").write_bytes(name.encode())
    return tmp_path


def test_read_maps_reads_pictures_and_places(folder):
    maps = read_maps(
        folder, {"maps": {"relief": 0.001, "texel": 0.0002, "folds": ["frown_left", "frown_right"]}}, MESH
    )
    assert maps.files == {"albedo": b"albedo", "relief": b"relief"}
    assert (maps.relief, maps.texel) == (0.001, 0.0002)
    assert maps.uv == pytest.approx(1)
    assert maps.folds == pytest.approx(1)
    assert maps.regions == ("frown_left", "frown_right")
    assert not maps.see_through.any()


def test_read_maps_of_a_face_without_any_is_none(tmp_path):
    assert read_maps(tmp_path, {}, {"vertices": MESH["vertices"], "triangles": MESH["triangles"]}) is None


@pytest.mark.parametrize(
    ("head", "change", "fault"),
    [
        ({"maps": {"relief": "high"}}, {}, r"\[maps\] relief: wanted metres, got 'high'"),
        ({"maps": {"texel": float("nan")}}, {}, r"\[maps\] texel: wanted metres, got nan"),
        ({}, {"uv": np.zeros((3, 3, 2))}, r"uv: wanted \(2, 3, 2\), got \(3, 3, 2\)"),
        ({}, {}, r"fold_weights: wanted \(4, 0\), got \(4, 2\)"),
        ({"maps": {"folds": "frown"}}, {}, r"folds: wanted names such as frown_left, got 'frown'"),
    ],
)
def test_read_maps_names_what_is_wrong(folder, head, change, fault):
    with pytest.raises(FaceError, match=fault):
        read_maps(folder, head, MESH | change)


def test_read_maps_needs_the_albedo_map(folder):
    (folder / "albedo.webp").unlink()
    with pytest.raises(FaceError, match=r"albedo\.webp: wanted this map, found none"):
        read_maps(folder, {}, MESH)
