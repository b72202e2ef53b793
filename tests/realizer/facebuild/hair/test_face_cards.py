"""Tests of all cards of a face."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from realizer.face.cards import Cards, read_cards
from realizer.face.deform import deform
from realizer.face.drawn_mesh import drawn_mesh
from realizer.face.load import folder_of, load_face
from realizer.face.mesh_geometry import components, edges_of, part_triangles
from realizer.face.model import Face
from realizer.facebuild.hair.face_cards import face_cards, write_cards
from realizer.facebuild.hair.lashes import Margin
from realizer.facebuild.inside import depths
from realizer.facebuild.person.recipe import Recipe
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
