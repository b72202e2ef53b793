"""Tests of the eyelids."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.face.deform import deform
from realizer.face.drawn_mesh import WET, drawn_mesh
from realizer.face.load import load_face
from realizer.face.mesh_geometry import part_triangles, vertex_normals
from realizer_studio.faces.person.lids import Lid, lid_fields
from realizer_studio.faces.person.makehuman import Figure
from tests.shipped import FACES

pytestmark = pytest.mark.xdist_group("mask")


def test_lid_rings_are_mirror_images(figure: Figure, mask_lids: list[Lid]) -> None:
    left, right = mask_lids
    for one, other in zip(left.rings, right.rings, strict=True):
        assert figure.at[one] == pytest.approx(figure.at[other] * [-1, 1, 1])


def test_lid_edges_run_from_the_inner_to_the_outer_corner(figure: Figure, mask_lids: list[Lid]) -> None:
    for lid in mask_lids:
        for edge in (lid.upper, lid.lower):
            assert (edge[0], edge[-1]) == (lid.inner, lid.outer)
            assert (np.diff(np.abs(figure.at[edge, 0])) > 0).all()
        assert set(lid.upper) | set(lid.lower) == set(lid.rings[0])
        assert figure.at[lid.upper, 1].mean() > figure.at[lid.lower, 1].mean()


def test_lid_gap_is_widest_between_the_corners_and_nothing_beyond(
    figure: Figure, mask_lids: list[Lid]
) -> None:
    for lid in mask_lids:
        inner, outer = figure.at[[lid.inner, lid.outer], 0]
        x = np.linspace(inner, outer, 21)
        gap = lid.gap(x)
        assert gap[[0, -1]] == pytest.approx(0, abs=1e-9)
        assert gap.max() == pytest.approx(lid.aperture, rel=0.05)
        assert not lid.gap(np.array([inner - lid.side * 0.001, outer + lid.side * 0.001])).any()
        assert lid.gap_of(figure.at, upper=True).max() == pytest.approx(lid.aperture, rel=0.05)
        assert lid.middle(np.array([(inner + outer) / 2])) == pytest.approx(0, abs=0.001)


def test_lid_fields_move_the_edge_s_middle_by_one(figure: Figure) -> None:
    made = lid_fields(figure)
    assert set(made) == {19, 20, 21, 22, 27, 28}
    for fap, point, way in ((19, "3.1", -1), (20, "3.2", -1), (21, "3.3", 1), (22, "3.4", 1)):
        assert made[fap][figure.points[point]] == pytest.approx([0, way, 0])


def test_lid_fields_of_both_lids_close_the_whole_opening(figure: Figure, mask_lids: list[Lid]) -> None:
    made, lid = lid_fields(figure), mask_lids[0]
    shut = figure.at + 0.5 * lid.aperture * (made[19] + made[21])
    upper, lower = (shut[edge] for edge in (lid.upper, lid.lower))
    below = np.interp(upper[:, 0], lower[:, 0], lower[:, 1])
    assert upper[:, 1] - below == pytest.approx(np.zeros(len(upper)), abs=0.15 * lid.aperture)


def test_lid_fields_leave_the_other_side_and_the_mouth(figure: Figure) -> None:
    made = lid_fields(figure)
    assert not made[19][figure.at[:, 0] < -0.001].any()
    assert not made[21][figure.at[:, 1] < -0.05].any()


def test_lid_fields_move_what_lies_behind_their_own_edge(figure: Figure, mask_lids: list[Lid]) -> None:
    made, lid = lid_fields(figure), mask_lids[0]
    leader, _ = lid.followers(figure)
    for fap, mine, other in ((19, lid.upper, lid.lower), (21, lid.lower, lid.upper)):
        moved = np.linalg.norm(made[fap], axis=1)
        for ring in lid.rings[1:4]:
            own, theirs = ([v for v in ring if leader[v] in edge[4:-4]] for edge in (mine, other))
            assert moved[own].min() > 4 * moved[theirs].max()


def test_lid_fields_move_the_corners_with_the_edge_too(figure: Figure, mask_lids: list[Lid]) -> None:
    made, lid = lid_fields(figure), mask_lids[0]
    leader, _ = lid.followers(figure)
    for fap, edge in ((19, lid.upper), (21, lid.lower)):
        moved = np.linalg.norm(made[fap], axis=1)
        share = [moved[v] / moved[leader[v]] for v in lid.rings[2] if leader[v] in edge[1:-1]]
        assert min(share) > 0.6 * max(share)


DEEPEST = 0.0003  # m


@pytest.mark.parametrize("name", FACES)
def test_tears_lie_between_the_lower_lids_and_the_eyes(name: str) -> None:
    face = load_face(name)
    mesh, at = drawn_mesh(face), face.vertices.astype(float)
    first, last = face.parts["tears"]
    strip = at[first:last]
    assert (mesh.kind[slice(*mesh.parts["tears"])] == WET).all()
    ups = vertex_normals(strip, part_triangles(face.triangles, face.parts["tears"]))
    for eye, (_, centre) in enumerate(face.basis["eyes"]):
        mine = (strip[:, 0] > 0) == (eye == 0)
        away = strip[mine] - centre
        room = np.linalg.norm(away, axis=1) - face.basis["bulges"][eye][2]
        assert 0 < room.min() < np.median(room) < 0.0005
        assert ((ups[mine] * away).sum(axis=1) > 0).mean() > 0.9  # in the corners it is aslant
        low = face.points["3.3" if eye == 0 else "3.4"][1]
        assert low - 0.001 < strip[mine, 1].min() < low + 1e-5 < strip[mine, 1].max()


@pytest.mark.parametrize("name", FACES)
def test_tears_follow_the_lid_and_stay_before_the_eye(name: str) -> None:
    face = load_face(name)
    first, last = face.parts["tears"]
    pose = np.zeros((1, 68), np.float32)
    pose[0, [20, 21]], pose[0, [24, 25]] = 300, 40000
    at = deform(face, pose)[0].astype(float)
    risen = at[first:last] - face.vertices[first:last]
    assert risen[:, 1].max() == pytest.approx(300 * face.fapu.metres("IRISD"), rel=0.1)
    for eye, (_, centre) in enumerate(face.basis["eyes"]):
        mine = (face.vertices[first:last, 0] > 0) == (eye == 0)
        away = np.linalg.norm(at[first:last][mine] - centre, axis=1)
        assert away.min() > face.basis["bulges"][eye][2] - DEEPEST
