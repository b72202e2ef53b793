"""Tests of the displacement matrices of a face."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realizer.animation.lips.visemes import mouth_faps, shape_table
from realizer.core.errors import FaceError
from realizer.face.basis import (
    JAW_COS,
    LIMITS,
    basis_from,
    bulge_at,
    pack,
    unpack,
)
from realizer.face.load import folder_of, load_face
from realizer.face.model import Face
from realizer.tables import au_to_fap


@pytest.fixture(scope="module")
def face() -> Face:
    return load_face()


@pytest.fixture(scope="module")
def stored(face: Face) -> dict[str, Any]:
    """The arrays of a face that FAP 31 moves by one vertex and the jaw by another."""
    raised, turned = np.zeros((2, len(face.vertices), 3))
    raised[7], turned[9] = (0, 0.5, 0), (0, 0, 0.25)
    few: dict[str, Any] = {"lid": np.array([3]), "lid_eye": np.array([0]), "lid_radius": np.array([0.01])}
    few |= {"jaw_pivot": np.zeros(3), "head_pivot": np.ones(3), "eye_centre": np.eye(2, 3)}
    return pack({31: raised, JAW_COS + 1: turned}) | few | {"head": np.full(len(face.vertices), 51, np.uint8)}


def read(face: Face, tmp_path: Path, arrays: dict[str, Any]) -> dict[str, Any]:
    np.savez(tmp_path / "fields.npz", **arrays)
    return basis_from(tmp_path / "fields.npz", face.vertices, face.points, face.parts, face.fapu)


def test_pack_leaves_out_what_is_too_little_to_be_seen() -> None:
    field = np.zeros((6, 3))
    field[2], field[4] = (0, 0.5, 0), (0, 0.001, 0)
    packed = pack({31: field})
    assert packed["row"].tolist() == [31]
    assert packed["vertex"].tolist() == [2]
    (row,) = unpack(packed, 6).values()
    assert row.tolist() == (field * (field > 0.01)).tolist()


def test_pack_and_unpack_are_inverse_on_a_face_s_own_fields(face: Face) -> None:
    with np.load(folder_of("default") / "fields.npz") as file:
        stored = {name: file[name] for name in ("row", "start", "vertex", "move")}
    again = pack(unpack(stored, len(face.vertices)))
    assert all(np.array_equal(again[name], stored[name]) for name in stored)


def test_basis_rows_are_metres_for_each_fapu(face: Face, stored: dict[str, Any], tmp_path: Path) -> None:
    basis = read(face, tmp_path, stored)
    assert basis["moving"] == (7, 10)
    fields = basis["fields"].toarray().reshape(3, 3, -1)
    assert fields[0, :, 30] == pytest.approx([0, 0.5 * face.fapu.metres("ENS"), 0])
    assert fields[2, :, JAW_COS] == pytest.approx([0, 0, 0.25])
    assert np.count_nonzero(fields) == 2
    assert basis["head"] == pytest.approx(0.2)
    assert basis["chin"] == pytest.approx(face.points["2.1"][1:])
    assert [ball for ball, _ in basis["eyes"]] == [face.parts["left_eye"], face.parts["right_eye"]]


def test_basis_of_eyes_with_fields_of_their_own_has_no_balls(
    face: Face, stored: dict[str, Any], tmp_path: Path
) -> None:
    basis = read(face, tmp_path, stored | {"row": np.array([23, 70], np.int32)})
    assert [ball for ball, _ in basis["eyes"]] == [(0, 0), (0, 0)]


@pytest.mark.parametrize(
    ("name", "values", "words"),
    [
        ("head", np.zeros(3), r"head: wanted \d+ values, one a vertex, got 3"),
        ("lid", np.array([-1]), r"lid: wanted 0\.\.\d+, got -1\.\.-1"),
        ("vertex", np.array([7, 10**6]), r"vertex: wanted 0\.\.\d+, got 7\.\.1000000"),
        ("jaw_pivot", np.full(3, np.nan), "jaw_pivot: wanted finite numbers"),
        ("row", np.array([0]), r"row: wanted 1\.\.141, got 0\.\.0"),
        ("start", np.array([0, 1]), r"start: wanted an array \(\d+,\), got \(2,\)"),
        ("lid", np.array([0.5]), "lid: wanted whole numbers, got float64"),
        ("move", np.zeros(2), r"move: wanted 2 dimensions, got \(2,\)"),
    ],
)
def test_basis_with_a_bad_array_is_refused(
    face: Face, stored: dict[str, Any], tmp_path: Path, name: str, values: Any, words: str
) -> None:
    with pytest.raises(FaceError, match=rf"fields\.npz: {words}"):
        read(face, tmp_path, stored | {name: values})


def test_bulge_at_is_how_far_the_cornea_comes_out_there() -> None:
    bulge = np.float32([0, 0.4, 0.5, 1.6]), np.float32([0.001, 0.0005, 0, 0]), 0.012
    ahead, up = np.array([0.0, 0, 1]), np.array([0.0, np.sin(0.4), np.cos(0.4)])
    places = 0.012 * np.stack([ahead, up])
    assert bulge_at(bulge, places, ahead) == pytest.approx([0.001, 0.0005])
    assert bulge_at(bulge, places, up) == pytest.approx([0.0005, 0.001])
    assert bulge_at(bulge, places * [1, -1, 1], up) == pytest.approx([0.0005, 0])


def test_limits_are_what_action_units_and_visemes_stay_below() -> None:
    visemes = mouth_faps(shape_table()[0])
    for fap, most in LIMITS.items():
        assert max(abs(row.fap_to) for row in au_to_fap() if row.fap == fap) <= most, fap
        assert np.abs(visemes.get(fap, np.zeros(1))).max() <= most, fap
