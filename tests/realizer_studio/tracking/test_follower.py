"""Tests of faces followed from picture to picture."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from realizer_studio.tracking import follower
from realizer_studio.tracking.follower import Follower, LandmarkCache, follow
from realizer_studio.tracking.landmarks import Landmarks, landmarks
from realizer_studio.tracking.pictures import Picture
from tests.portraits import LITERT, portrait

pytestmark = [LITERT, pytest.mark.gl("onboard")]


def scene(**places: int) -> Image.Image:
    """A picture with faces, each so many pixels from the left."""
    picture = Image.new("RGB", (900, 320), (80, 90, 100))
    for name, left in places.items():
        picture.paste(portrait(name), (left, 0))
    return picture


def people(*scenes: Image.Image) -> list[list[int]]:
    pictures = [Picture(k / 10, picture, "test") for k, picture in enumerate(scenes)]
    return [person.frames for person in follow(pictures)[1]]


def test_follower_keeps_who_moves() -> None:
    assert people(*(scene(ada=10 * k) for k in range(8))) == [list(range(8))]


def test_follower_tells_people_apart() -> None:
    scenes = [scene(ada=5 * k, ben=560 - 5 * k) for k in range(5)]
    assert people(*scenes) == [list(range(5))] * 2


def test_follower_knows_who_comes_back() -> None:
    there, empty = scene(ada=300), scene()
    assert people(there, there, empty, empty, there) == [[0, 1, 4]]


def test_follower_finds_who_comes_later() -> None:
    scenes = [scene(ada=0)] * 10 + [scene(ada=0, ben=500)] * 12
    assert sorted(map(len, people(*scenes)))[1] == 22
    assert len(people(*scenes)) == 2


def test_follower_takes_no_new_face_that_is_not_certain(monkeypatch: pytest.MonkeyPatch) -> None:
    sure = {"presence": 0.65}

    def unsure(*given: Any, **how: Any) -> Landmarks:
        return replace(landmarks(*given, **how), **sure)

    monkeypatch.setattr(follower, "landmarks", unsure)
    there = scene(ada=300)
    assert people(there, there) == []
    sure["presence"] = 0.95
    find = Follower()
    find(Picture(0.0, there, "test"))
    sure["presence"] = 0.65
    find(Picture(0.1, there, "test"))
    assert [person.frames for person in find.people] == [[0, 1]]


def test_follower_finds_nobody_in_an_empty_scene() -> None:
    assert people(scene(), scene()) == []


class Interrupted(Exception):
    pass


def film(count: int, broken: int | None = None, looked: list[int] | None = None):  # type: ignore[no-untyped-def]
    """Yield pictures of a face; an interrupt comes before the one with that number."""
    for k in range(count):
        if k == broken:
            raise Interrupted
        if looked is not None:
            looked.append(k)
        yield Picture(k / 10, portrait("ada"), "film")


def kept(tmp_path: Path) -> LandmarkCache:
    if not (tmp_path / "film.mp4").exists():
        (tmp_path / "film.mp4").write_bytes(b"film")
    made = LandmarkCache(tmp_path / "out.csv.part", tmp_path / "film.mp4")
    made.every = 2
    return made


def test_unfinished_run_goes_on_and_gives_the_same(tmp_path: Path) -> None:
    with pytest.raises(Interrupted):
        follow(film(6, broken=5), kept(tmp_path))
    again = kept(tmp_path)
    times, follower = again.read()
    assert times == [0, 0.1, 0.2, 0.3]
    assert [person.frames for person in follower.people] == [[0, 1, 2, 3]]
    resumed, whole = follow(film(6), kept(tmp_path)), follow(film(6))
    assert resumed[0] == whole[0]
    for one, other in zip(resumed[1], whole[1], strict=True):
        assert one.frames == other.frames
        for name in ("points", "traits", "eyes"):
            values = [[getattr(face, name) for face in person.faces] for person in (one, other)]
            assert np.array_equal(*values)
    again.remove()
    assert [path.name for path in tmp_path.iterdir()] == ["film.mp4"]


def test_unfinished_of_another_film_or_damaged_is_not_used(tmp_path: Path) -> None:
    follow(film(4), kept(tmp_path))
    (tmp_path / "out.csv.part/1.npz").write_bytes(b"cut")
    assert len(kept(tmp_path).read()[0]) == 2
    (tmp_path / "film.mp4").write_bytes(b"other")
    assert kept(tmp_path).read()[0] == []
    assert not (tmp_path / "out.csv.part").exists()
