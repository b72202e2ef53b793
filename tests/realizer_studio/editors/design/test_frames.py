"""Tests of `realizer_studio.editors.design.frames`."""

from __future__ import annotations

import io
from base64 import b64decode
from typing import Any

import numpy as np
import pytest
from PIL import Image

from realizer.core.settings import Settings
from realizer.expressions.library import builtin
from realizer.expressions.timeline import Entry, Timeline, Track
from realizer.expressions.timeline_file import write_timeline
from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.face.surface import face_scale, quantise
from realizer.offline import realize
from realizer_studio.editors.design.frames import (
    FILE,
    THUMB,
    document,
    expression_frame,
    sheet,
    timeline_frames,
)

SETTINGS = Settings(voice="silent", idle=False)
TIMELINE = Timeline((Track("a", (Entry("template:surprise", 0.8, 1.2), Entry("smile"))),))


def vertices(answer: dict[str, Any]) -> np.ndarray:
    return np.frombuffer(b64decode(answer["data"]), "<i2").reshape(answer["count"], -1, 3)


def test_timeline_frames_are_those_of_the_film(tmp_path) -> None:
    (tmp_path / FILE).write_text(write_timeline(TIMELINE), "utf-8")
    film = realize(document(), media=tmp_path, idle=False, voice="silent")
    found = timeline_frames({"first": 10, "count": 4}, TIMELINE, SETTINGS)
    face = load_face("default")
    expected = quantise(face, deform(face, film.poses[10:14]))
    assert np.abs(vertices(found) - expected.astype(int)).max() <= 1
    assert (found["first"], found["face"]) == (10, "default")


def test_timeline_frames_change_with_an_edit() -> None:
    louder = Timeline((Track("a", (Entry("template:surprise", 1.0, 1.2), Entry("smile"))),))
    one, other = (vertices(timeline_frames({"first": 12}, t, SETTINGS)) for t in (TIMELINE, louder))
    assert np.abs(one.astype(int) - other).max() * face_scale(load_face("default"))[0] > 0.0002


def test_expression_frame_tells_what_cooccurrence_leaves() -> None:
    found = expression_frame({"aus": {"12L": 0.9, "12R": 0.9, "15L": 0.9, "4": 0}}, SETTINGS)
    assert found["asked"] == {"12L": 0.9, "12R": 0.9, "15L": 0.9}
    assert found["seen"] == pytest.approx({"12L": 0.2, "12R": 0.9, "15L": 0.9})
    rest = expression_frame({"aus": {}}, SETTINGS)
    assert rest["seen"] == {}
    assert np.abs(vertices(found).astype(int) - vertices(rest)).max() > 0


@pytest.mark.gl("onboard")
@pytest.mark.long
@pytest.mark.slow
def test_sheet_has_a_picture_of_each_expression() -> None:
    picture = Image.open(io.BytesIO(sheet("ada", SETTINGS)))
    assert picture.size == (8 * THUMB, -(-len(builtin()) // 8) * THUMB)
    smile = list(builtin()).index("SMILE")
    at = lambda k: np.asarray(picture, int)[k // 8 * THUMB :, k % 8 * THUMB :][:THUMB, :THUMB]  # noqa: E731
    assert (
        np.abs(
            at(smile) - at(list(builtin()).index("CLOSE_MOUTH" if "CLOSE_MOUTH" in builtin() else "ANGER"))
        ).max()
        > 30
    )
