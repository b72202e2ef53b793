"""Tests of all cards of a face."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from realizer.face.cards import Cards, read_cards
from realizer.face.deform import deform
from realizer.face.drawn_mesh import drawn_mesh
from realizer.face.load import folder_of, load_face
from realizer.face.mesh_geometry import components, edges_of, grid, part_triangles
from realizer.face.model import Face
from realizer_studio.faces.hair.cards import Patch
from realizer_studio.faces.hair.face_cards import bind, depths, face_cards, without_rim, write_cards
from realizer_studio.faces.hair.facial_hair import Margin
from realizer_studio.faces.person.recipe import Recipe
from realizer_studio.faces.person.scalp import Scalp
from tests.penetration import DEEPEST, part_of
from tests.shipped import FACES

BEYOND = 0.002  # m from a hair's root
BESIDE_JAW = 0.0025  # m that a beard is in the throat when the jaw falls


@pytest.fixture(scope="module")
def cards(head: Face, margin: Margin) -> Cards:
    raw = tomllib.loads((folder_of("ada") / "recipe.toml").read_text("utf-8"))
    recipe = Recipe("A head", {}, raw["colours"], {"style": "short", "cards": 40, "border": 20})
    return face_cards(head, recipe, [margin], np.zeros(head.parts["skin"][1]))


def test_face_cards_have_hair_brows_and_lashes(cards: Cards, head: Face) -> None:
    assert list(cards.parts) == ["hair", "brows", "lashes"]
    assert cards.parts["lashes"][1] == len(cards.uv)
    assert cards.weights.sum(axis=1) == pytest.approx(np.ones(len(cards.uv)), abs=1e-4)
    at = np.einsum("ck,ckx->cx", cards.weights, head.vertices[cards.roots])
    brows = at[slice(*cards.parts["brows"])]
    assert brows[:, 1].min() > head.points["3.1"][1]
    assert brows[:, 0].min() == pytest.approx(-brows[:, 0].max(), abs=0.006)


def test_write_cards_writes_what_read_cards_reads(cards: Cards, head: Face, tmp_path: Path) -> None:
    (tmp_path / "face.toml").write_text('name = "x"\n', "utf-8")
    write_cards(tmp_path, cards)
    written = read_cards(
        tmp_path, tomllib.loads((tmp_path / "face.toml").read_text("utf-8")), len(head.vertices)
    )
    assert written is not None
    assert written.parts == cards.parts
    assert np.array_equal(written.roots, cards.roots)
    assert written.uv == pytest.approx(cards.uv, abs=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("name", FACES)
@pytest.mark.parametrize("jaw", [0, 600])
def test_face_cards_stay_out_of_the_skin_beyond_their_roots(name: str, jaw: float) -> None:
    face = load_face(name)
    mesh = drawn_mesh(face)
    pose = np.zeros((1, 68), np.float32)
    pose[0, [2, 4, 51]] = jaw, -jaw, -jaw
    at = np.asarray(mesh.places @ deform(face, pose)[0], float)
    skin = part_of(face, "skin")
    for part in ("hair", "brows", "lashes", "beard"):
        if (ends := mesh.parts.get(f"{part}_cards")) is None:
            continue
        places, along = at[slice(*ends)], mesh.uv[slice(*ends), 1]
        card = components(edges_of(part_triangles(mesh.triangles, ends))[0], len(places))
        order = np.argsort(along, kind="stable")
        root = order[np.unique(card[order], return_index=True)[1]]
        away = np.linalg.norm(places - places[root][card], axis=1)
        depth = depths(places, at, skin, 0.01)[0]
        assert depth[away > BEYOND].max() < (BESIDE_JAW if jaw and part == "beard" else DEEPEST), part


@pytest.fixture
def patch(head: Face) -> Patch:
    """A place above the crown, one beside the neck, and one 5 mm before a brow."""
    brow = head.feature_points["4.3"]
    places = np.array([[0.01, 0.13, -0.05], [0.08, -0.12, -0.05], head.vertices[brow] + [0, 0, 0.005]])
    skin, shares = np.full((3, 3), -1), np.zeros((3, 3))
    skin[2], shares[2, 0] = brow, 1
    ups = np.array([[0, 1.0, 0], [1.0, 0, 0], [0, 0, 1.0]])
    one = np.ones(3)
    return Patch(places, ups, np.ones((3, 2)), np.ones((3, 3)), one, one, np.array([[0, 1, 2]]), skin, shares)


def followed(cards: Cards, at: np.ndarray) -> np.ndarray:
    return np.einsum("ck,ckx->cx", cards.weights.astype(float), at[cards.roots])


def bound(head: Face, patch: Patch, scalp: Scalp) -> Cards:
    return bind(patch, head.vertices.astype(float), head.triangles, scalp, head.basis["head"][:, 0], {})


def test_bind_finds_every_place_again_at_rest(head: Face, patch: Patch, scalp: Scalp) -> None:
    cards = bound(head, patch, scalp)
    assert followed(cards, head.vertices.astype(float)) == pytest.approx(patch.positions, abs=1e-6)
    assert cards.weights.sum(axis=1) == pytest.approx(np.ones(3), abs=1e-6)


def test_bind_turns_hair_with_the_head(head: Face, patch: Patch, scalp: Scalp) -> None:
    at, pivot = head.vertices.astype(float), np.array(head.points["7.1"], float)
    turn = np.array([[0, 0, 1.0], [0, 1, 0], [-1, 0, 0]])  # a quarter to the left
    share = head.basis["head"][:, :1]
    moved = followed(bound(head, patch, scalp), at + share * ((at - pivot) @ (turn - np.eye(3)).T))
    whole = (patch.positions - pivot) @ turn.T + pivot
    assert moved[[0, 2]] == pytest.approx(whole[[0, 2]], abs=1e-5)
    assert np.linalg.norm(moved[1] - whole[1]) > 0.001  # hangs between head and bust


def test_bind_keeps_a_hair_as_long_where_its_skin_moves(head: Face, patch: Patch, scalp: Scalp) -> None:
    at = head.vertices.astype(float)
    at[head.feature_points["4.3"]] += [0.004, 0.008, 0]
    moved = followed(bound(head, patch, scalp), at)
    assert moved[2] - at[head.feature_points["4.3"]] == pytest.approx([0, 0, 0.005], abs=1e-6)


RADIUS = 0.01
NEAR = 0.008


def ball(rows: int = 24, columns: int = 48) -> tuple[np.ndarray, np.ndarray]:
    """A ball without its poles."""
    turn, rise = np.meshgrid(
        np.arange(columns) * 2 * np.pi / columns, np.linspace(-1.4, 1.4, rows), indexing="xy"
    )
    at = RADIUS * np.stack([np.cos(rise) * np.cos(turn), np.cos(rise) * np.sin(turn), np.sin(rise)], -1)
    triangles = grid(rows, columns, closed=True)
    a, b, c = at.reshape(-1, 3)[triangles[0]]
    outwards = np.cross(b - a, c - a) @ a > 0
    return at.reshape(-1, 3), triangles if outwards else triangles[:, ::-1]


def test_depths_of_a_ball_are_below_its_surface() -> None:
    at, triangles = ball()
    ways = np.random.default_rng(1).normal(size=(60, 3))
    ways[:, 2] *= 0.3
    ways = ways[np.abs(ways[:, 2]) < np.hypot(*ways.T[:2])]
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    for deep in (-0.004, -0.0003, 0.0003, 0.004):
        depth, out = depths(ways * (RADIUS - deep), at, triangles, NEAR)
        assert depth == pytest.approx(deep, abs=1.5e-4)
        assert (out * ways).sum(axis=1) == pytest.approx(deep, abs=1.5e-4)


def test_depths_know_the_side_of_a_sharp_edge() -> None:
    # A roof: most of its area is on one side of the ridge.
    at = np.array([[-1, 0, 0], [1, 0, 0], [-1, 9, -1], [1, 9, -1], [-1, -0.1, -1], [1, -0.1, -1.0]]) / 1000
    triangles = np.array([[0, 1, 3], [0, 3, 2], [1, 0, 4], [1, 4, 5]], np.int32)
    places = np.array([[0.3, -0.5, 0.1], [0.3, 0.0, 0.2], [0.3, 0.2, -0.3]]) / 1000
    depth, _ = depths(places, at, triangles, NEAR)
    assert (depth > 0).tolist() == [False, False, True]


def test_depths_are_not_known_far_away() -> None:
    at, triangles = ball()
    depth, out = depths(np.array([[0.05, 0, 0]]), at, triangles, 0.002)
    assert depth.tolist() == [-np.inf]
    assert not out.any()


def test_without_rim_leaves_the_triangles_inside_a_surface() -> None:
    assert len(without_rim(grid(5, 5))) == 2 * 2 * 2
