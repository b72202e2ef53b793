"""Animated pictures, as Pillow reads them."""

from __future__ import annotations

import numpy as np
import pytest
from PIL import Image

from realizer.offline import realize
from realizer.outputs.registry import OUTPUTS
from realizer.outputs.webp import encode_webp


def pictures(count, size=(61, 80)):
    """A bright square that walks to the right over a coloured slope."""
    y, x = np.mgrid[0 : size[0], 0 : size[1]]
    for k in range(count):
        picture = np.stack([x, 40 + y // 2, np.full_like(x, 90)], -1).astype(np.uint8)
        picture[20:40, 8 * k : 8 * k + 20] = (220, 180, 150)
        yield picture


def opened(path):
    """[(seconds shown, (h, w, 3) pixels)], and how often it plays."""
    with Image.open(path) as image:
        found = []
        for k in range(image.n_frames):
            image.seek(k)
            image.load()
            found.append((image.info["duration"] / 1000, np.asarray(image.convert("RGB"))))
        return found, image.info["loop"]


def test_webp_has_every_picture_at_its_time(tmp_path):
    path = tmp_path / "x.webp"
    path.write_bytes(encode_webp(pictures(7), [0, 0.04, 0.08, 0.5, 0.6, 0.7, 0.8], 1.0))
    found, loop = opened(path)
    assert [shown for shown, _ in found] == [0.04, 0.04, 0.42, 0.1, 0.1, 0.1, 0.2]
    assert loop == 0  # for ever
    for (_, got), wanted in zip(found, pictures(7), strict=True):
        assert got.shape == wanted.shape
        assert np.abs(got.astype(int) - wanted).mean() < 6


def test_webp_times_do_not_drift(tmp_path):
    path = tmp_path / "x.webp"
    path.write_bytes(encode_webp(pictures(9), [k / 24 for k in range(9)], 9 / 24))
    found, _ = opened(path)
    assert {shown for shown, _ in found} == {0.041, 0.042}
    assert sum(shown for shown, _ in found) == pytest.approx(9 / 24)


@pytest.mark.gl
@pytest.mark.slow
def test_webp_of_a_realization_shows_its_face(realization, tmp_path, rendering):
    settings = rendering((97, 96))
    OUTPUTS[".webp"].write(realization, tmp_path / "x.webp", settings)
    found, _ = opened(tmp_path / "x.webp")
    assert len(found) == 38
    assert {shown for shown, _ in found} == {0.04}
    drawn = settings.renderer.draw(realization.poses)
    for (_, got), wanted in zip(found, drawn, strict=True):
        assert np.abs(got.astype(int) - wanted).mean() < 4
    assert np.abs(found[0][1].astype(int) - found[10][1]).max() > 20


@pytest.mark.gl
@pytest.mark.slow
def test_webp_has_at_most_25_pictures_a_second(tmp_path, rendering):
    quick = realize('<bml id="b"><head id="n" lexeme="NOD" end="0.5"/></bml>', fps=60, idle=False)
    OUTPUTS[".webp"].write(quick, tmp_path / "x.webp", rendering((32, 32)))
    found, _ = opened(tmp_path / "x.webp")
    assert len(found) == len(quick.poses[::3])
    assert {shown for shown, _ in found} == {0.05}


def test_webp_shows_a_picture_for_at_most_three_bytes_of_milliseconds(tmp_path):
    path = tmp_path / "x.webp"
    path.write_bytes(encode_webp(pictures(1), [0.0], 1e5))
    ((shown, _),) = opened(path)[0]
    assert shown == pytest.approx(16_777.215, abs=1e-4)


def test_webp_of_one_picture(tmp_path):
    path = tmp_path / "x.webp"
    path.write_bytes(encode_webp(pictures(1), [0.0], 0.04))
    ((shown, got),) = opened(path)[0]
    assert shown == 0.04
    assert got.shape == (61, 80, 3)
