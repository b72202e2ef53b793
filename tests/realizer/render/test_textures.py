"""`texels_of`: maps decoded, with slopes for heights, in levels."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from realizer.core.errors import FaceError
from realizer.face.maps import Maps
from realizer.render.textures import (
    ALPHA,
    FOLD,
    FOLD_U,
    FOLD_V,
    LARGEST,
    LEVEL,
    OCCLUSION,
    SLOPE_U,
    SLOPE_V,
    STEEPEST,
    THICKNESS,
    normal_map,
    slopes_in,
    texels_of,
)  # fmt: skip


def encoded(pixels):
    stream = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(stream, "webp", lossless=True, exact=True)
    return stream.getvalue()


def maps(**pictures):
    return Maps({name: encoded(pixels) for name, pixels in pictures.items()}, None, 0.0, 1.0, None, None)


WHITE = np.full((32, 32, 4), 255)


def test_texels_of_no_maps_change_nothing():
    assert np.array_equal(texels_of(None).level(0), LEVEL[None, None])


def test_texels_of_heights_are_their_slopes():
    """A plane that rises by 4 steps a texel to the right, of a map 64 times as coarse as the full one."""
    ramp = np.tile(np.arange(32) * 4, (32, 1))
    files = {"albedo": encoded(WHITE), "relief": encoded(ramp), "folds": encoded(ramp.T)}
    found = texels_of(Maps(files, None, 0.255, 0.0005, None, None))
    slopes = (found.level(0)[1:-1, 1:-1].astype(float) - 128) * STEEPEST / 127
    assert slopes[..., SLOPE_U] == pytest.approx(4 * 0.001 / (0.0005 * 64), abs=0.01)
    assert slopes[..., SLOPE_V] == pytest.approx(0, abs=0.01)
    assert slopes[..., FOLD_V] == pytest.approx(4 * 0.001 / (0.0005 * 64), abs=0.01)


def test_texels_of_folds_have_their_depth():
    heights = np.full((4, 4), 128)
    heights[1, :2], heights[2, :2] = (0, 64), (128, 255)
    depth = texels_of(maps(albedo=WHITE[:4, :4], folds=heights)).level(0)[..., FOLD]
    assert depth[1:3, :2].tolist() == [[255, 128], [0, 0]]
    assert texels_of(maps(albedo=WHITE)).level(0)[..., FOLD].max() == 0


def test_texels_of_a_normal_map_are_its_slopes():
    normal = np.full((32, 32, 3), (128 + 60, 128 + 30, 230))
    slopes = texels_of(maps(albedo=WHITE, normal=normal)).level(0)[0, 0].astype(int) - 128
    assert slopes[SLOPE_U] == pytest.approx(-127 * 60 / 102, abs=3)
    assert slopes[SLOPE_V] == pytest.approx(127 * 30 / 102, abs=3)


def test_texels_of_maps_have_levels_down_to_one():
    albedo = WHITE.copy()
    albedo[:, 16:] = (10, 20, 30, 0)
    surface = np.full((16, 16, 3), (200, 100, 50))
    found = texels_of(maps(albedo=albedo, surface=surface))
    assert [tuple(level[1:]) for level in found.levels] == [(n, n) for n in (32, 16, 8, 4, 2, 1)]
    assert found.level(5)[0, 0, :4].tolist() == [255, 255, 255, 128]
    assert found.level(0)[5, 5, OCCLUSION : THICKNESS + 1].tolist() == [200, 100, 50]
    assert found.level(0)[5, 5, FOLD_U] == 128
    assert found.level(1)[5, 12, ALPHA] == 0


def test_texels_of_maps_are_no_larger_than_asked_for():
    assert texels_of(maps(albedo=WHITE), 10).levels[0, 1:].tolist() == [8, 8]


def test_texels_of_a_broken_map_names_it():
    with pytest.raises(FaceError, match=r"albedo\.webp: wanted a picture"):
        texels_of(Maps({"albedo": b"no"}, None, 0.0, 1.0, None, None))


def bumpy(**pictures):
    """Maps whose relief is 5 cm high in steps, and whose texels are a fifth of a millimetre wide."""
    return replace(maps(**pictures), relief=0.05, texel=0.0002)


HILLS = 128 + 60 * np.sin(np.arange(32) / 3) * np.cos(np.arange(32)[:, None] / 4)


def test_normal_map_has_the_slopes_of_the_relief():
    found = bumpy(relief=HILLS)
    back = slopes_in(Maps({"normal": normal_map(found)}, None, 0.0, 1.0, None, None), "normal")
    assert back.astype(int) == pytest.approx(slopes_in(found, "relief").astype(int), abs=2)
    assert np.ptp(back) > 10


def test_normal_map_of_a_large_relief_is_half_as_large():
    ramp = np.tile(np.arange(2 * LARGEST) // 16, (8, 1))
    with Image.open(io.BytesIO(normal_map(bumpy(relief=ramp)))) as picture:
        assert picture.size == (LARGEST, 4)


def test_normal_map_of_a_face_that_has_one_is_that_one():
    found = bumpy(normal=np.full((4, 4, 3), 128))
    assert normal_map(found) == found.files["normal"]


def test_normal_map_of_level_skin_is_none():
    assert normal_map(bumpy(albedo=np.zeros((4, 4, 3)))) is None
