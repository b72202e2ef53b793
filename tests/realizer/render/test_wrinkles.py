"""Tests of wrinkles."""

from __future__ import annotations

import dataclasses
import json

import numpy as np
import pytest

from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.face.surface import normals
from realizer.render.wrinkles import Wrinkles

pytestmark = pytest.mark.xdist_group("render")

# What stands for an action unit on this face, in FAPs: each at full strength.
RAISED = {31: 220, 32: 220, 33: 160, 34: 160, 35: 120, 36: 120}
FROWN = {31: -150, 32: -150, 37: 170, 38: 170}
CHEEKS = {41: 400, 42: 400}
LEFT_CHEEK = {41: 400}
SPEECH = {3: 700, 4: -200, 5: -500, 51: -200, 52: -500}
BLINK = {19: 1024, 20: 1024}


@pytest.fixture(scope="module")
def face():
    return load_face("default")


@pytest.fixture(scope="module")
def wrinkles(face):
    return Wrinkles(face)


def pose(face, values):
    row = np.zeros((1, 68), np.float32)
    for fap, value in values.items():
        row[0, fap - 1] = value
    vertices = deform(face, row)
    return vertices[0], normals(face, vertices)[0]


def darker(face, wrinkles, values):
    """(count, 3) points and how much darker the strips are there than the skin, which is all of one grey."""
    vertices, ups = pose(face, values)
    points, colours = wrinkles(vertices, ups, np.full((len(vertices), 3), 0.5, np.float32))
    return points, (0.5 - colours[:, 1]) * 2 * colours.any(axis=1)


def seen(points, tone, low, high, side=None):
    """The strongest tone between two heights, on one side or on both."""
    y = points[:, 1]
    here = (y > low) & (y < high) & ((side is None) | (points[:, 0] * (side or 1) > 0.002))
    return float(tone[here].max(initial=0))


@pytest.mark.parametrize("values", [{}, SPEECH, BLINK, {49: 9000}, {23: 5000}])
def test_wrinkles_are_none_at_rest_speech_blink_and_turn(face, wrinkles, values):
    _, tone = darker(face, wrinkles, values)
    assert np.abs(tone).max() < 0.06


def test_wrinkles_of_raised_brows_are_on_the_forehead(face, wrinkles):
    points, tone = darker(face, wrinkles, RAISED)
    assert seen(points, tone, 0.025, 0.09) > 0.12
    assert seen(points, tone, -0.2, 0.01) < 0.02


def test_wrinkles_of_a_frown_are_between_the_brows(face, wrinkles):
    points, tone = darker(face, wrinkles, FROWN)
    strong = points[tone > 0.1]
    assert len(strong)
    assert np.abs(strong[:, 0]).max() < 0.02
    assert strong[:, 1].min() > -0.01


def test_wrinkles_of_lifted_cheeks_are_beside_the_nose(face, wrinkles):
    both, one = darker(face, wrinkles, CHEEKS), darker(face, wrinkles, LEFT_CHEEK)
    for side in (1, -1):
        assert seen(*both, -0.08, -0.02, side) > 0.08
    assert seen(*one, -0.08, -0.02, 1) > 0.08
    assert seen(*one, -0.08, -0.02, -1) < 0.02


def test_wrinkles_deepen_with_the_movement(face, wrinkles):
    tones = [
        darker(face, wrinkles, {fap: part * value for fap, value in RAISED.items()})[1].max()
        for part in (0, 0.4, 0.7, 1)
    ]
    assert tones == sorted(tones)
    assert tones[0] == 0 < tones[1]


def test_wrinkles_lie_on_the_skin_and_end_in_its_colour(face, wrinkles):
    vertices, ups = pose(face, RAISED)
    points, _ = darker(face, wrinkles, RAISED)
    first, last = face.parts["skin"]
    from scipy.spatial import cKDTree

    away, nearest = cKDTree(vertices[first:last]).query(points)
    above = ((points - vertices[first:last][nearest]) * ups[first:last][nearest]).sum(axis=1)
    assert away.max() < 0.008
    assert np.median(above) == pytest.approx(0.0004, abs=0.0003)
    _, tone = darker(face, wrinkles, RAISED)
    assert np.abs(tone.reshape(-1, 7)[:, [0, -1]]).max() < 1e-6


def test_wrinkles_face_outwards(face, wrinkles):
    vertices, ups = pose(face, {**RAISED, **FROWN, **CHEEKS})
    points, _ = wrinkles(vertices, ups, np.full((len(vertices), 3), 0.5, np.float32))
    a, b, c = (points[wrinkles.triangles[:, k]] for k in range(3))
    outward = np.cross(b - a, c - a)[:, 2]
    assert (outward > 0).mean() > 0.97


def test_wrinkles_need_feature_points(balls):
    face, ups = balls
    bare = Wrinkles(face)
    points, colours = bare(face.vertices, ups, np.ones_like(face.vertices))
    assert bare.count == len(points) == len(colours) == len(bare.triangles) == 0


def test_wrinkles_are_left_out_on_a_coarse_mesh(face):
    """The same head seen as if its eyes stood close together: its triangles are long beside its furrows."""
    small = dataclasses.replace(face, fapu=dataclasses.replace(face.fapu, es0=face.fapu.es0 / 6))
    assert Wrinkles(small).count < Wrinkles(face).count / 4


def test_wrinkles_to_json_make_the_same_points_and_tones(face, wrinkles):
    """As a page does it."""
    table = json.loads(json.dumps(wrinkles.to_json()))
    vertices, ups = pose(face, {**RAISED, **FROWN})
    grey = np.full((len(vertices), 3), 0.5, np.float32)
    points, colours = wrinkles(vertices, ups, grey)
    amounts = []
    for a, b, rest, start, full in table["drives"]:
        change = np.linalg.norm(vertices[int(a)] - vertices[int(b)]) / rest - 1
        reached = np.clip((change - start) / (full - start), 0, 1)
        amounts.append(reached * reached * (3 - 2 * reached))
    rows = np.array(table["points"])
    corners = rows[:, :3].astype(int)
    weights = np.column_stack([rows[:, 3:], 1 - rows[:, 3:].sum(axis=1)])[..., None]
    lifted = vertices + table["lift"] * ups
    assert (lifted[corners] * weights).sum(axis=1) == pytest.approx(points, abs=2e-5)
    tone = np.array([sum(amounts[k] * t for k, t in pairs) for pairs in table["tones"]])[:, None]
    shown = 0.5 * (1 - np.maximum(tone, 0) * table["shade"] + np.maximum(-tone, 0))
    assert shown == pytest.approx(colours, abs=1e-3)


def test_wrinkles_follow_the_monotone_cubic_through_knots():
    from scipy.interpolate import PchipInterpolator

    from realizer.render.wrinkles import _through

    random = np.random.default_rng(0)
    for count in (2, 3, 6):
        along = np.concatenate([[0], np.cumsum(random.random(count - 1) + 0.05)])
        knots = random.normal(size=(count, 2))
        where = np.linspace(0, along[-1], 17)
        assert _through(along, knots, where) == pytest.approx(PchipInterpolator(along, knots)(where))
