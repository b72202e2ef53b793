"""Tests of what is kept of a film that is not tracked to its end."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer.tracking.follower import follow
from realizer.tracking.pictures import Picture
from realizer.tracking.unfinished import Unfinished
from tests.portraits import LITERT, portrait

pytestmark = [LITERT, pytest.mark.gl("onboard")]


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


def kept(tmp_path: Path) -> Unfinished:
    if not (tmp_path / "film.mp4").exists():
        (tmp_path / "film.mp4").write_bytes(b"film")
    made = Unfinished(tmp_path / "out.csv.part", tmp_path / "film.mp4")
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
