"""Parameters of faces with and without action units."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer import tables
from realizer.animation.axis import AU_NAMES, axis
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses

FAPS = tuple(row.name for row in tables.faps())


def frames(*rows: dict[str, float]) -> AUFrames:
    values = np.zeros((len(rows), len(axis())), np.float32)
    for row, named in zip(values, rows, strict=True):
        for name, value in named.items():
            row[axis()[name].column] = value
    return AUFrames(np.arange(len(rows), dtype=np.float64), values)


faces = st.dictionaries(st.sampled_from(AU_NAMES()), st.floats(0, 1, width=32), max_size=6)


@given(st.lists(faces, min_size=1, max_size=4))
def test_poses_of_a_fap_face_are_those_of_the_fap_stream(rows: list[dict[str, float]]) -> None:
    clip = frames(*rows)
    assert np.array_equal(poses(clip, FAPS), to_fap(clip).values)


@given(faces, st.sets(st.sampled_from(AU_NAMES())))
def test_poses_exclude_faps_of_units_that_the_face_has(face: dict[str, float], taken: set[str]) -> None:
    names = (*FAPS, *sorted(taken), "lips")
    (row,) = poses(frames({**face, "lips": 0.25}), names)
    others = {name: value for name, value in face.items() if name not in taken}
    assert np.array_equal(row[:68], to_fap(frames({**others, "lips": 0.25})).values[0])
    assert row[68:-1] == pytest.approx([face.get(name, 0) for name in sorted(taken)])
    assert row[-1] == 0.25


def test_poses_of_a_unit_face_include_gaze_speech_and_set_faps() -> None:
    names = (*FAPS, "12L", "12R", "lips")
    (row,) = poses(frames({"12L": 1, "61": 0.5, "51": 0.5, "open_jaw": 300, "lips": 1}), names)
    found = dict(zip(names, row, strict=True))
    assert found["12L"] == 1
    assert found["raise_l_cornerlip"] == 0
    assert found["open_jaw"] == 300
    assert found["head_yaw"] > 10_000
    assert found["yaw_l_eyeball"] > 10_000


@given(faces, st.sets(st.sampled_from(AU_NAMES())), st.integers(3, 68), st.sampled_from([0.0, 0.5, 1.0]))
def test_poses_show_a_set_fap_on_both_kinds_of_faces(
    face: dict[str, float], taken: set[str], number: int, part: float
) -> None:
    held = np.zeros((1, 68), np.float32)
    held[0, number - 1] = part
    clip = replace(frames({**face, FAPS[number - 1]: part * 50.0}), overridden=held)
    (units,) = poses(clip, (*FAPS, *sorted(taken)))
    # The movement by the units of such a face, and by its other FAPs.
    all_, others = (
        to_fap(frames({name: value for name, value in face.items() if name not in without})).values[0]
        for without in (set(), taken)
    )
    whole = poses(clip, FAPS)[0, number - 1]
    assert units[number - 1] + (all_ - others)[number - 1] == pytest.approx(whole, rel=1e-4, abs=1e-2)
    if part == 1:
        assert whole == 50


def test_poses_refuse_an_unknown_name() -> None:
    with pytest.raises(KeyError, match="wings"):
        poses(frames({}), (*FAPS, "wings"))
