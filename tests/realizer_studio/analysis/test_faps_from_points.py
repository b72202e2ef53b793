"""Tests of `realizer_studio.analysis.faps_from_points`."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.face.model import Face
from realizer.tables import faps
from realizer_studio.analysis.faps_from_points import (
    bridge,
    facial_features,
    faps_from_features,
    faps_from_points,
    features_from_points,
    read_points,
)
from tests.mesh_features import points_of


def test_facial_features_are_15_in_the_units_of_their_faps() -> None:
    rows = facial_features()
    assert [row.number for row in rows] == list(range(1, 16))
    for row in rows:
        assert {faps()[fap - 1].unit for fap in (*row.signs, *row.also)} == {row.unit}


def test_facial_features_of_eyes_have_the_opposite_sign_of_lids() -> None:
    features = {row.number: row for row in facial_features()}
    assert features[12].signs == {19: -1, 21: -1}
    assert features[13].signs == {20: -1, 22: -1}


@pytest.fixture(scope="module")
def face() -> Face:
    return load_face("ada")


def rest(face: Face) -> dict[str, np.ndarray]:
    return {name: face.vertices[index] for name, index in face.feature_points.items()}


def row(**values: float) -> np.ndarray:
    frame = np.zeros(68, np.float32)
    for name, value in values.items():
        frame[int(name[1:]) - 1] = value
    return frame


def test_faps_from_points_measures_each_fap_at_its_point(face: Face) -> None:
    local = [fap for fap in faps()[2:] if fap.unit not in ("none", "angle_unit") and fap.fap not in (29, 30)]
    # Behind closed teeth there is little room for the tongue.
    values = [20 if fap.group == 6 else 50 for fap in local]
    frames = np.stack([row(**{f"F{fap.fap}": value}) for fap, value in zip(local, values, strict=True)])
    read, seen = faps_from_points(points_of(face, deform(face, frames)), rest(face), face.fapu)
    for k, (fap, value) in enumerate(zip(local, values, strict=True)):
        assert seen[fap.fap - 1]
        # What lifts the chin's boss lifts the chin a little too, which its measure is relative to.
        assert read[k, fap.fap - 1] == pytest.approx(value, abs=9 if fap.fap == 18 else 1), fap.name


def test_faps_from_points_removes_the_pose_of_the_head(face: Face) -> None:
    frames = np.stack([row(F48=9000, F49=-20000, F50=5000, F12=200, F13=200, F31=150), row()])
    points = points_of(face, deform(face, frames))
    read, _ = faps_from_points(points, rest(face), face.fapu)
    assert read[0, 47:50] == pytest.approx((9000, -20000, 5000), abs=20)
    assert read[0, [11, 12, 30]] == pytest.approx((200, 200, 150), abs=2)
    assert np.abs(read[1]).max() < 0.1
    moved = {name: at + np.array([0.3, -0.1, 2.0]) for name, at in points.items()}
    again, _ = faps_from_points(moved, rest(face), face.fapu)
    assert np.allclose(again, read, atol=1)


def test_faps_from_points_uses_corners_of_the_eyes_without_a_skull(face: Face) -> None:
    frames = row(F49=15000, F31=150)[None]
    points = points_of(face, deform(face, frames))
    few = {name: points[name] for name in ("3.7", "3.8", "3.11", "3.12", "4.1", "2.4")}
    read, seen = faps_from_points(few, rest(face), face.fapu)
    assert read[0, 48] == pytest.approx(15000, abs=100)
    assert read[0, 30] == pytest.approx(150, abs=3)
    assert set(np.flatnonzero(seen) + 1) == {6, 12, 31, 37, 48, 49, 50}


def test_faps_from_points_of_a_lost_point_are_unobserved(face: Face) -> None:
    points = points_of(face, deform(face, np.stack([row(F12=100), row(F12=100)])))
    points["2.4"] = points["2.4"].copy()
    points["2.4"][1] = np.nan
    read, seen = faps_from_points(points, rest(face), face.fapu)
    assert not seen[11]
    assert seen[12]
    assert read[1, 11] == 0
    assert np.isfinite(read).all()


def test_features_from_points_agree_with_faps(face: Face) -> None:
    frames = np.stack([row(F19=200, F21=100), row(F31=100), row(F53=80, F54=80), row(F51=60)])
    features = features_from_points(points_of(face, deform(face, frames)), rest(face), face.fapu)
    assert features[0, 11] == pytest.approx(-300, rel=0.05)
    assert features[1, 4] == pytest.approx(100, rel=0.25)  # the distance to the eye's corner slants
    assert features[2, 13] == pytest.approx(160, rel=0.05)
    assert features[3, 2] == pytest.approx(60, rel=0.15)  # the outer lip, where the paper names the inner FAP


def test_features_from_points_do_not_depend_on_the_pose_of_the_head(face: Face) -> None:
    still, turned = row(F31=100, F19=-150), row(F31=100, F19=-150, F48=9000, F49=20000)
    features = features_from_points(
        points_of(face, deform(face, np.stack([still, turned]))), rest(face), face.fapu
    )
    assert np.allclose(features[0], features[1], atol=3)


def test_faps_from_features_shares_a_feature_equally() -> None:
    features = np.zeros((1, 15))
    features[0, [0, 11, 13, 14]] = 30, 100, 80, 500
    frames, seen = faps_from_features(features)
    assert frames[0, [18, 20]] == pytest.approx([-50, -50])
    assert frames[0, [5, 6, 52, 53]] == pytest.approx([40, 40, 40, 40])
    assert frames[0, 36] == 30  # and not a half of the 500
    assert set(np.flatnonzero(seen) + 1) == {fap for f in facial_features() for fap in (*f.signs, *f.also)}


def test_faps_from_points_refuses_invalid_points(face: Face) -> None:
    here = {name: at[None] for name, at in rest(face).items()}
    for points, neutral, said in (
        ({}, rest(face), "wanted at least one feature point, got none"),
        ({"99.1": np.zeros(3)}, rest(face), "wanted those with a neutral position, got 99.1"),
        (here | {"2.1": np.zeros((4, 3))}, rest(face), r"all of one n, got \(1, 3\), \(4, 3\)"),
        (here, rest(face) | {"2.1": np.zeros(2)}, r"neutral: wanted \(3,\) each, got \(2,\)"),
        (here, rest(face) | {"2.1": np.full(3, np.nan)}, "neutral: wanted finite places"),
    ):
        with pytest.raises(ValueError, match=said):
            faps_from_points(points, neutral, face.fapu)
    del here["9.3"]
    with pytest.raises(ValueError, match=r"these are missing: 9\.3"):
        features_from_points(here, rest(face), face.fapu)
    with pytest.raises(ValueError, match=r"wanted \(n, "):
        faps_from_features(np.zeros((3, 4)))


TABLE = """\
# tracked by hand
frame,point,x,y,z
0,4.1,0.015,0.017,0.028
0,2.1,0,-0.1,0.012

1,4.1,0.015,0.018,0.028
3,4.1,0.015,0.020,0.028
1,2.1,0,-0.11,0.012
2,2.1,0,-0.12,0.012
3,2.1,0,-0.13,0.012
"""


def test_read_points_has_nan_for_lost_points() -> None:
    points, rest = read_points(TABLE)
    assert points["4.1"].shape == points["2.1"].shape == (4, 3)
    assert np.isnan(points["4.1"][2]).all()
    assert list(points["2.1"][3]) == [0, -0.13, 0.012]
    assert list(rest["4.1"]) == [0.015, 0.017, 0.028]


def test_bridge_interpolates_linearly() -> None:
    points, _ = read_points(TABLE)
    whole = bridge(points)
    assert whole["4.1"][2] == pytest.approx([0.015, 0.019, 0.028])
    assert np.array_equal(whole["2.1"], points["2.1"])


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "t: wanted a first line frame,point,x,y,z, got ''"),
        ("time,x\n1,2", "t: wanted a first line frame,point,x,y,z, got 'time,x'"),
        (TABLE + "4,2.1,0,up,0\n", "t, line 11: wanted frame,point,x,y,z, got '4,2.1,0,up,0'"),
        (TABLE + "4,2.1,0,0\n", "t, line 11: wanted frame"),
        (TABLE + "3,2.1,0,0,0\n", "t, line 11: point 2.1 is there twice in frame 3"),
        (TABLE + "-1,2.1,0,0,0\n", r"t, line 11: wanted a frame 0\.\."),
        (TABLE + "4,2.1,0,nan,0\n", "finite places"),
        (TABLE + "0,99.9,0,0,0\n", "t, line 11: wanted a point of MPEG-4, 2.1 to 11.6, got '99.9'"),
        (TABLE + "3,4.2,0,0,0\n", "t: wanted every point at rest in frame 0, got none of 4.2"),
    ],
)
def test_read_points_refuses_an_invalid_line(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=said):
        read_points(text, "t")
