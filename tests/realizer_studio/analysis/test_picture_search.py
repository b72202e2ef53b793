"""Tests of `realizer_studio.analysis.picture_search`."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.animation.axis import au, axis
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses
from realizer.expressions.library import builtin
from realizer.face.load import input_names
from realizer_studio.analysis.picture_search import UnknownPictureError, by_picture, read_picture
from tests.pictures import drawn_here

pytestmark = pytest.mark.xdist_group("picture_search")  # neutral pictures are drawn once in a process

NAMES = ("SMILE", "RAISE_LEFT_BROW", "RAISE_RIGHT_BROW", "template:anger", "template:sadness", "OPEN_MOUTH")
KNOWN = [builtin()[name] for name in NAMES]


def drawn(face: str, light: str, size: tuple[int, int], intensity: float) -> list[np.ndarray]:
    """The neutral face, and each of these expressions."""
    rows = np.zeros((len(KNOWN) + 1, len(axis())), np.float32)
    for row, one in zip(rows[1:], KNOWN, strict=True):
        for (number, side), value in one.aus.items():
            row[[target.column for target in au(number, side)]] = value * intensity
    frames = AUFrames(np.arange(len(rows), dtype=np.float64), rows)
    return list(drawn_here(face, size, poses(frames, input_names(face)), light=light)[..., :3])


@pytest.mark.long
@pytest.mark.slow
def test_by_picture_finds_face_light_and_expression_at_any_size() -> None:
    small = drawn("ben", "evening", (150, 200), 0.7)
    neutral, *pictures = drawn("ben", "evening", (300, 400), 0.7)
    # Among all faces, and of a known one.
    for one, picture, faces in ((KNOWN[1], pictures[1], None), (KNOWN[0], small[1], ["ben"])):
        seen = by_picture(picture, KNOWN, faces)
        assert (seen.face, seen.light, seen.neutral) == ("ben", "evening", False)
        assert seen.matches[0][0] is one
        scores = [score for _, score in seen.matches]
        assert scores == sorted(scores, reverse=True)
        assert scores[0] > 0.75
    rest = by_picture(neutral, KNOWN)
    assert rest.neutral
    assert rest.matches == ()


@pytest.mark.parametrize("shape", [(400, 300, 3), (900, 20, 3), (20, 900, 3)])
@pytest.mark.slow
def test_by_picture_refuses_an_unknown_face(shape: tuple[int, int, int]) -> None:
    noise = np.random.default_rng(0).integers(0, 255, shape).astype(np.uint8)
    with pytest.raises(UnknownPictureError, match="wanted a picture of one of our faces from the front"):
        by_picture(noise, KNOWN, ["ben"])


def test_read_picture_refuses_other_files(tmp_path) -> None:
    (tmp_path / "a.png").write_text("no", "utf-8")
    with pytest.raises(UnknownPictureError, match=r"a\.png: wanted a picture"):
        read_picture(tmp_path / "a.png")
