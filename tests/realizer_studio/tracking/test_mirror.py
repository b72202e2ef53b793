"""Tests of the face in front of a camera."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from realizer_studio.tracking.mirror import Mirror
from realizer_studio.tracking.network import TrackingError
from tests.portraits import LITERT, faps_of, portrait

pytestmark = [LITERT, pytest.mark.gl("onboard")]


def jpeg(picture: Image.Image) -> bytes:
    content = io.BytesIO()
    picture.save(content, "jpeg", quality=90)
    return content.getvalue()


def test_mirror_follows_an_expression() -> None:
    mirror, rest = Mirror(), jpeg(portrait("ben"))
    smile = jpeg(portrait("ben", faps_of("ben", AU12=0.9)))
    still = [mirror(rest, k / 20) for k in range(12)][-1]
    smiling = [mirror(smile, 0.6 + k / 20) for k in range(5)]
    assert still is not None
    assert still.units["12L"] < 0.15
    values = [sight.units["12L"] for sight in smiling if sight is not None]
    # It rises to a plateau, on which the face is found anew in each picture, to a fraction of a pixel.
    assert np.diff(values).min() > -0.002
    assert values[-1] > 0.5


def test_mirror_sees_the_head_turn() -> None:
    faps = np.zeros(68, np.float32)
    faps[48] = np.radians(20) / 1e-5
    sight = Mirror()(jpeg(portrait("ada", faps)), 0)
    assert sight is not None
    assert sight.head == pytest.approx((0, 20, 0), abs=6)
    assert sight.units["51"] > 0.2


def test_mirror_sees_nobody_and_finds_who_comes_back() -> None:
    mirror, there = Mirror(), jpeg(portrait())
    empty = jpeg(Image.new("RGB", (320, 320), (90, 80, 70)))
    assert [mirror(picture, 0) is not None for picture in (there, empty, there)] == [True, False, True]


def test_mirror_refuses_what_is_no_picture() -> None:
    buffer = io.BytesIO()
    Image.effect_noise((40, 40), 90).save(buffer, "png")
    png = buffer.getvalue()
    damaged = png[:33] + (400).to_bytes(4, "big") + png[37:]  # its first chunk of pixels ends too soon
    for content in (b"no picture", b"", png[:40], damaged):
        with pytest.raises(TrackingError, match="wanted a JPEG"):
            Mirror()(content, 0)
