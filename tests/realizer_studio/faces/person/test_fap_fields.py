"""Tests of the fields of FAPs on the base mesh."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.basis import BEYOND, FAPS, JAW_COS, JAW_DROP, JAW_SIN, LIMITS, TONGUE_COS, TONGUE_SIN
from realizer.tables import faps
from realizer_studio.faces.mpeg4.zone_fields import DIRECTIONS
from realizer_studio.faces.person.lids import Lid
from realizer_studio.faces.person.makehuman import Figure

pytestmark = pytest.mark.xdist_group("mask")
Fields = dict[int, np.ndarray]


def test_face_fields_serve_all_faps_but_turns(fields: Fields) -> None:
    driven = {row.fap for row in faps()[2:] if row.unit == "angle_unit" or row.direction == "growing"}
    extra = {row + 1 for row in (JAW_COS, JAW_SIN, JAW_DROP, TONGUE_COS, TONGUE_SIN)}
    far = {BEYOND + fap for fap in LIMITS}
    assert set(fields) == {*range(3, FAPS + 1)} - driven - {3} | extra | ({43, 44} & set(fields)) | far


def test_face_fields_move_each_feature_point_by_one(figure: Figure, fields: Fields) -> None:
    for row in faps()[2:]:
        if row.fap in fields and row.direction in DIRECTIONS and row.feature_point in figure.points:
            move = fields[row.fap][figure.points[row.feature_point]]
            assert move @ np.array(DIRECTIONS[row.direction]) == pytest.approx(1, abs=1e-6), row.name


def test_face_fields_of_two_sides_mirror(figure: Figure, fields: Fields) -> None:
    twin = figure.mesh.mirror()
    for row in faps()[2:]:
        if row.fap in fields:
            mirrored = row.sign * fields[row.mirror][twin] * [-1, 1, 1]
            assert np.allclose(fields[row.fap], mirrored, atol=1e-9), row.name


def test_face_fields_of_brows_share_what_lies_between(figure: Figure, fields: Fields) -> None:
    # Each brow FAP leaves the feature points of the others where they are.
    names = {31: "4.1", 32: "4.2", 33: "4.3", 34: "4.4", 35: "4.5", 36: "4.6"}
    for fap in names:
        for other, name in names.items():
            up = fields[fap][figure.points[name], 1]
            assert up == pytest.approx(1 if other == fap else 0, abs=1e-6)


def test_face_fields_of_brows_keep_the_skin_below_above_the_lid(figure: Figure, fields: Fields) -> None:
    lid = Lid(figure, 1)
    at = figure.at[np.concatenate(lid.rings[1:])]
    off = at[:, 1] - np.interp(at[:, 0], lid.x, lid.high)
    over = (at[:, 0] > lid.x[3]) & (at[:, 0] < lid.x[-3]) & (off > 0.001)
    fall = 0.6 * (figure.point("4.3")[1] - figure.point("3.1")[1])
    down = fall * sum(fields[fap][np.concatenate(lid.rings[1:]), 1] for fap in (31, 33, 35))
    assert over.sum() > 20
    assert (off > down)[over].all()


def test_face_fields_of_the_jaw_leave_the_upper_face(figure: Figure, fields: Fields) -> None:
    high = figure.body & (figure.at[:, 1] > -0.03)
    for row in (JAW_COS, JAW_SIN, JAW_DROP):
        assert np.abs(fields[row + 1][high]).max() < 0.05
    assert fields[JAW_DROP + 1][figure.points["2.1"]] == pytest.approx([0, -1, 0])


def test_face_fields_of_the_tongue_move_the_tongue_alone(figure: Figure, fields: Fields) -> None:
    tongue = np.zeros(len(figure.at), bool)
    tongue[np.unique(figure.mesh.quads["helper-tongue"])] = True
    for fap in (43, 44, 45, 46, TONGUE_COS + 1, TONGUE_SIN + 1):
        assert not fields[fap][~tongue].any()
