"""Tests of the maps that the textures of an imported head become."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from PIL import Image

from realizer_studio.faces.arkit.materials import CLAMP, MIRROR, REPEAT, Chart, Material, Texture
from realizer_studio.faces.arkit.mesh_merge import Surface
from realizer_studio.faces.arkit.texture_atlas import PAD, SIZE, Atlas, make_atlas, pack

CORNERS = np.array([[0.1, 0.1], [0.9, 0.1], [0.1, 0.9]])


class Pictures:
    """The pictures of a file."""

    path = "head.glb"

    def __init__(self, *pictures: Any) -> None:
        self.pictures = pictures

    def pixels(self, image: int) -> Any:
        return self.pictures[image]


def material(wrap: int = REPEAT, alpha: str = "OPAQUE", **images: int) -> Material:
    chart = Chart("TEXCOORD_0", wrap=(wrap, wrap))
    textures = tuple((slot, Texture(image, chart)) for slot, image in images.items())
    rough = 0.5 if "roughness" in images else None
    return Material("", (1, 1, 1, 1), (0, 0, 0), rough, alpha, 0.5, 0, textures)


def surface(materials: Sequence[Material], uv: Any = CORNERS) -> Surface:
    """A triangle for each material."""
    m = len(materials)
    triangles = np.arange(3 * m, dtype=np.int32).reshape(m, 3)
    plain = np.zeros(3 * m, np.int32)
    return Surface(
        np.zeros((3 * m, 3)), triangles, np.zeros((3 * m, 3)), plain, (), {}, np.tile(uv, (m, 1, 1)),
        np.arange(m, dtype=np.int32), tuple(materials),
    )  # fmt: skip


def seen(atlas: Atlas | None, name: str, triangle: int) -> Any:
    """Return the texel of a map in the middle of a triangle."""
    assert atlas is not None
    picture = np.asarray(Image.open(io.BytesIO(atlas.files[name])).convert("RGBA"))
    x, y = (atlas.uv[triangle].mean(axis=0) / 65535 * SIZE).astype(int)
    return picture[y, x].astype(int)


def flat(*colour: int, size: tuple[int, int] = (32, 32)) -> Any:
    return np.full((*size, 4), (*colour, *((255,) if len(colour) == 3 else ())), np.uint8)


def test_make_atlas_keeps_colour_normal_and_roughness_of_two_materials() -> None:
    pictures = Pictures(flat(200, 60, 20), flat(20, 90, 220, size=(17, 301)), flat(200, 128, 230))
    atlas = make_atlas(pictures, surface([material(base=0, normal=2), material(base=1, roughness=2)]), {})
    assert seen(atlas, "albedo", 0)[:3] == pytest.approx([200, 60, 20], abs=4)
    assert seen(atlas, "albedo", 1)[:3] == pytest.approx([20, 90, 220], abs=4)
    assert seen(atlas, "normal", 0)[:3] == pytest.approx([200, 128, 232], abs=6)
    assert seen(atlas, "normal", 1)[:3] == pytest.approx([128, 128, 255], abs=4)
    assert seen(atlas, "surface", 1)[:3] == pytest.approx([255, 128, 255], abs=5)
    assert atlas is not None
    assert atlas.gloss == pytest.approx([np.nan, 0.625], nan_ok=True)


def test_make_atlas_shares_a_patch_of_materials_that_look_alike() -> None:
    rough = [replace(material(base=0), name=str(k), roughness=k / 4) for k in range(5)]
    atlas = make_atlas(Pictures(flat(9, 9, 9)), surface(rough), {})
    assert atlas is not None
    assert (atlas.uv == atlas.uv[0]).all()
    assert atlas.gloss == pytest.approx([1, 0.9375, 0.625, 0.3125, 0])


def test_make_atlas_multiplies_factor_and_adds_emission() -> None:
    lit = Material("", (0.5, 0.5, 0.5, 1), (0, 0, 1), None, "OPAQUE", 0.5, 0, material(base=0).textures)
    atlas = make_atlas(Pictures(flat(255, 0, 0)), surface([lit]), {})
    assert seen(atlas, "albedo", 0)[:3] == pytest.approx([188, 0, 255], abs=6)


@pytest.mark.parametrize(("alpha", "left"), [("OPAQUE", 255), ("MASK", 0), ("BLEND", 90)])
def test_make_atlas_keeps_the_alpha_of_the_mode(alpha: str, left: int) -> None:
    atlas = make_atlas(Pictures(flat(9, 9, 9, 90)), surface([material(alpha=alpha, base=0)]), {})
    assert seen(atlas, "albedo", 0)[3] == pytest.approx(left, abs=2)
    assert atlas is not None
    assert atlas.see_through.tolist() == [left < 255]


@pytest.mark.parametrize(("wrap", "wanted"), [(REPEAT, 1), (MIRROR, 0), (CLAMP, 1)])
def test_make_atlas_repeats_textures_as_the_sampler_says(wrap: int, wanted: int) -> None:
    halves = flat(250, 0, 0)
    halves[:, 16:, :3] = 0, 0, 250
    moved = np.clip(CORNERS * [0.3, 1] + [1.6, 0], 0, 1 if wrap == CLAMP else 9)  # as scene.py gives it
    atlas = make_atlas(Pictures(halves), surface([material(wrap, base=0)], moved), {})
    colours = [[250, 0, 0], [0, 0, 250]]
    assert seen(atlas, "albedo", 0)[:3] == pytest.approx(colours[wanted], abs=8)


@pytest.mark.slow
def test_make_atlas_shrinks_what_is_larger_than_it() -> None:
    wide = flat(40, 80, 120, size=(3000, 3000))
    many = [material(base=0) for _ in range(3)]
    atlas = make_atlas(Pictures(wide), surface(many, CORNERS * 1.2 - 0.1), {})
    for k in range(3):
        assert seen(atlas, "albedo", k)[:3] == pytest.approx([40, 80, 120], abs=4)


def test_make_atlas_draws_a_picture_that_is_broken_by_its_factor() -> None:
    atlas = make_atlas(Pictures(None), surface([material(base=0)]), {})
    assert seen(atlas, "albedo", 0).tolist() == [255] * 4


def test_make_atlas_is_none_without_textures() -> None:
    assert make_atlas(Pictures(), surface([material()]), {}) is None


def test_pack_puts_patches_beside_each_other_and_the_neutral_square() -> None:
    sizes = [(300, 200), (1000, 1500), (700, 1500), (16, 16), (500, 400)]
    places = pack(sizes)
    assert places is not None
    taken = np.zeros((SIZE, SIZE), int)
    taken[: 16 + PAD, : 16 + PAD] = 1
    for (x, y), (width, height) in zip(places, sizes, strict=True):
        taken[y : y + height, x : x + width] += 1
    assert taken.max() == 1
    assert pack([(1500, 1500)] * 2) is None
    assert pack([(SIZE + 1, 8)]) is None
