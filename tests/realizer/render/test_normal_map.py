"""`normal_map`: relief as other programs read it."""

import io

import numpy as np
import pytest
from PIL import Image

from realizer.face.maps import Maps
from realizer.render.normal_map import LARGEST, normal_map
from realizer.render.textures import slopes_in


def encoded(pixels):
    stream = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(stream, "webp", lossless=True)
    return stream.getvalue()


def maps(**pictures):
    files = {name: encoded(pixels) for name, pixels in pictures.items()}
    return Maps(files, None, 0.05, 0.0002, None, None)


HILLS = 128 + 60 * np.sin(np.arange(32) / 3) * np.cos(np.arange(32)[:, None] / 4)


def test_normal_map_has_the_slopes_of_the_relief():
    found = maps(relief=HILLS)
    back = slopes_in(Maps({"normal": normal_map(found)}, None, 0.0, 1.0, None, None), "normal")
    assert back.astype(int) == pytest.approx(slopes_in(found, "relief").astype(int), abs=2)
    assert np.ptp(back) > 10


def test_normal_map_of_a_large_relief_is_half_as_large():
    ramp = np.tile(np.arange(2 * LARGEST) // 16, (8, 1))
    with Image.open(io.BytesIO(normal_map(maps(relief=ramp)))) as picture:
        assert picture.size == (LARGEST, 4)


def test_normal_map_of_a_face_that_has_one_is_that_one():
    found = maps(normal=np.full((4, 4, 3), 128))
    assert normal_map(found) == found.files["normal"]


def test_normal_map_of_level_skin_is_none():
    assert normal_map(maps(albedo=np.zeros((4, 4, 3)))) is None
