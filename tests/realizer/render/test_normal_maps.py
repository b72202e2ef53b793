"""`normal_maps`: relief and folds as other programs read them."""

import io

import numpy as np
import pytest
from PIL import Image

from realizer.face.maps import Maps
from realizer.render.normal_maps import normal_maps
from realizer.render.textures import slopes_in


def encoded(pixels):
    stream = io.BytesIO()
    Image.fromarray(np.asarray(pixels, np.uint8)).save(stream, "webp", lossless=True)
    return stream.getvalue()


def maps(**pictures):
    files = {name: encoded(pixels) for name, pixels in pictures.items()}
    return Maps(files, None, 0.05, 0.0002, None, None)


HILLS = 128 + 60 * np.sin(np.arange(32) / 3) * np.cos(np.arange(32)[:, None] / 4)


def test_normal_maps_have_the_slopes_of_relief_and_folds():
    found = maps(relief=HILLS, folds=HILLS.T)
    made = normal_maps(found)
    assert list(made) == ["normal", "folds"]
    for name, source in (("normal", "relief"), ("folds", "folds")):
        back = slopes_in(Maps({"normal": made[name]}, None, 0.0, 1.0, None, None), "normal")
        assert back.astype(int) == pytest.approx(slopes_in(found, source).astype(int), abs=2)
        assert np.ptp(back) > 10


def test_normal_maps_of_a_face_that_has_one_are_that_one():
    found = maps(normal=np.full((4, 4, 3), 128))
    assert normal_maps(found) == found.files


def test_normal_maps_of_level_skin_are_none():
    assert normal_maps(maps(albedo=np.zeros((4, 4, 3)))) == {}
