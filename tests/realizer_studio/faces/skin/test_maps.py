"""Tests of the bake of a face's maps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from realizer_studio.faces.parts import Part
from realizer_studio.faces.person.lids import Lid
from realizer_studio.faces.person.lips import Lips
from realizer_studio.faces.person.person import Person
from realizer_studio.faces.person.recipe import Recipe
from realizer_studio.faces.skin.maps import RELIEF, SkinMaps, bake
from realizer_studio.faces.skin.skin_atlas import EYES, NEUTRAL

pytestmark = pytest.mark.xdist_group("mask")


def test_bake_leaves_the_neutral_square_alone(maps: SkinMaps) -> None:
    square = NEUTRAL.texels(256)
    for name, level in (("albedo", 255), ("relief", 128), ("surface", 255), ("folds", 128)):
        assert (maps.pictures[name][square] == level).all(), name


def test_bake_draws_another_skin_for_another_name(
    maps: SkinMaps, person: Person, mask_lips: Lips, mask_lids: list[Lid], recipe: Recipe, parts: list[Part]
) -> None:
    other = bake("other", person, mask_lips, mask_lids, recipe, parts[0], 256)
    again = bake("mask", person, mask_lips, mask_lids, recipe, parts[0], 256)
    for name in maps.pictures:
        assert (again.pictures[name] == maps.pictures[name]).all()
        assert (other.pictures[name] != maps.pictures[name]).any()


def test_arrays_point_parts_without_a_picture_to_the_neutral_square(
    maps: SkinMaps, parts: list[Part]
) -> None:
    m = len(maps.corners)
    arrays = maps.arrays(parts)
    assert arrays["uv"].shape == (sum(len(part.triangles) for part in parts), 3, 2)
    names = np.repeat([part.name for part in parts], [len(part.triangles) for part in parts])
    assert (arrays["uv"][names == "tongue"] == 256).all()
    left, top, *_ = (round(65535 * side) for side in EYES)
    eyes = arrays["uv"][(names == "left_eye") | (names == "right_eye")]
    assert (eyes.min(axis=(0, 1)) >= (left, top)).all()
    assert (names[:m] == "skin").all()
    assert arrays["fold_weights"].shape == (sum(len(part.vertices) for part in parts), len(maps.regions))


def test_write_makes_pictures(maps: SkinMaps, tmp_path: Path) -> None:
    maps.write(tmp_path)
    with Image.open(tmp_path / "albedo.webp") as picture:
        assert picture.size == (256, 256)
    with Image.open(tmp_path / "relief.webp") as picture:
        level = np.asarray(picture.convert("L"))
    assert abs(int(level[0, 0]) - 128) <= 1


def test_head_names_scale_and_regions(maps: SkinMaps) -> None:
    head = maps.head()
    assert head["relief"] == RELIEF
    assert "frown_left" in head["folds"]
