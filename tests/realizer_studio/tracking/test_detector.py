"""Tests of the detector of faces."""

from __future__ import annotations

import pytest
from PIL import Image

from realizer_studio.tracking.detector import detect
from tests.portraits import LITERT, pixels_of, portrait

pytestmark = [LITERT, pytest.mark.gl("onboard")]


def test_detector_finds_the_face_in_a_picture() -> None:
    (face,) = detect(portrait())
    nose = pixels_of("ada")["9.3"]
    assert (face.x, face.y) == pytest.approx(tuple(nose), abs=30)
    assert 100 < face.side < 320


def test_detector_tells_two_people_apart() -> None:
    both = Image.new("RGB", (640, 320))
    both.paste(portrait("ada"), (0, 0))
    both.paste(portrait("ben"), (320, 0))
    assert sorted(round(face.x / 320 - 0.5) for face in detect(both)) == [0, 1]


def test_detector_finds_a_small_face_in_a_corner() -> None:
    scene = Image.new("RGB", (1600, 1000), (90, 100, 110))
    scene.paste(portrait().resize((260, 260)), (1300, 700))
    (face,) = detect(scene)
    assert (face.x, face.y) == pytest.approx((1430, 830), abs=30)


def test_detector_finds_every_small_face_of_a_group_once() -> None:
    scene = Image.new("RGB", (1500, 1000), (90, 100, 110))
    places = [(200 + 300 * k, 300 + 90 * (k % 2)) for k in range(4)]
    for (x, y), name in zip(places, ("ada", "ben", "ada", "ben"), strict=True):
        scene.paste(portrait(name).resize((160, 160)), (x - 80, y - 80))
    found = sorted((face.x, face.y) for face in detect(scene))
    assert found == [pytest.approx(place, abs=15) for place in places]


def test_detector_looks_for_small_faces_only_if_asked() -> None:
    scene = Image.new("RGB", (1500, 1000), (90, 100, 110))
    scene.paste(portrait().resize((600, 600)), (0, 0))
    scene.paste(portrait("ben").resize((120, 120)), (1300, 800))
    assert [len(detect(scene, small)) for small in (True, False)] == [2, 1]


def test_detector_finds_no_face_where_there_is_none() -> None:
    assert detect(Image.new("RGB", (400, 300), (120, 90, 60))) == []
