"""Tests of all cards of a face."""

import tomllib
from pathlib import Path

import numpy as np
import pytest

from realizer.face.cards import Cards, read_cards
from realizer.face.load import folder_of
from realizer.face.model import Face
from realizer.facebuild.hair.face_cards import face_cards, write_cards
from realizer.facebuild.hair.lashes import Margin
from realizer.facebuild.person.recipe import Recipe


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
