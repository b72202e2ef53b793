"""`read_cards`: strips of hair beside the mesh, or one sentence on what is wrong with them."""

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer.face.cards import FILE, read_cards

ARRAYS = {
    "roots": np.zeros((3, 4), np.int32),
    "weights": np.full((3, 4), 0.25),
    "ups": np.full((3, 4), 0.25),
    "triangles": np.array([[0, 1, 2]]),
    "uv": np.full((3, 2), 65535, np.uint16),
    "colours": np.full((3, 3), 9, np.uint8),
    "occlusion": np.full(3, 255, np.uint8),
    "gloss": np.zeros(3, np.uint8),
}


def read(folder, **change):
    np.savez(folder / FILE, **(ARRAYS | change))
    return read_cards(folder, {"cards": {"brows": [0, 3]}}, 5)


def test_read_cards_reads_strips(tmp_path):
    cards = read(tmp_path)
    assert cards.parts == {"brows": (0, 3)}
    assert cards.uv == pytest.approx(1)
    assert cards.occlusion == pytest.approx(1)


def test_read_cards_of_a_face_without_any_is_none(tmp_path):
    assert read_cards(tmp_path, {}, 5) is None


@pytest.mark.parametrize(
    ("change", "fault"),
    [
        ({"roots": np.full((3, 4), 5)}, r"roots: wanted indices 0\.\.4, got 5\.\.5"),
        ({"triangles": np.array([[0, 1, 3]])}, r"triangles: wanted indices 0\.\.2, got 0\.\.3"),
        ({"weights": np.full((3, 4), np.nan)}, r"weights: wanted finite numbers"),
        ({"uv": np.zeros((3, 3))}, r"uv: wanted finite numbers \(3, 2\), got \(3, 3\)"),
    ],
)
def test_read_cards_names_what_is_wrong(tmp_path, change, fault):
    with pytest.raises(FaceError, match=fault):
        read(tmp_path, **change)
