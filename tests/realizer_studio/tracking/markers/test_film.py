"""Tests of `realizer_studio.tracking.markers.film`."""

from __future__ import annotations

import json

import numpy as np
import pytest
from PIL import Image, ImageDraw

from realizer.animation.fap.fap_reader import read_fap
from realizer_studio.analysis.faps_from_points import read_points
from realizer_studio.tracking.markers.colours import named
from realizer_studio.tracking.markers.film import (
    FORMATS,
    Markers,
    MarkerSettings,
    blobs,
    faps_of,
    track_markers,
)
from realizer_studio.tracking.markers.layout import wojdel
from realizer_studio.tracking.network import TrackingError
from tests.painted import acted, hidden, plain, truth

COLOURS = (named("green"), named("blue"))


@pytest.fixture(scope="module")
def tracked() -> Markers:
    """Markers of ada, who raises the brows and opens the mouth; some are hidden."""
    gone = hidden(30, 0.02, 1)
    gone[0] = False
    return track_markers(plain(truth("ada", acted()), gone), MarkerSettings(COLOURS), "film")


def test_track_markers_finds_them_to_a_pixel(tracked: Markers) -> None:
    off = np.linalg.norm(tracked.pixels - truth("ada", acted()), axis=2)
    assert np.median(off) < 0.5
    assert off.max() < 3
    assert tracked.layout.names == wojdel().names
    assert tracked.visible.mean() == pytest.approx(0.98, abs=0.015)


def test_faps_of_markers_are_those_of_the_face(tracked: Markers) -> None:
    values, seen = faps_of(tracked, "ada")
    shown = acted()
    assert seen[[30, 31, 51, 2]].all()
    assert not seen[[15, 16, *range(47, 50)]].any()  # towards the camera, and the head
    for fap in (31, 32, 3):
        assert np.corrcoef(values[:, fap - 1], shown[:, fap - 1])[0, 1] > 0.95
        assert np.ptp(values[:, fap - 1]) == pytest.approx(np.ptp(shown[:, fap - 1]), rel=0.35)


def test_formats_have_the_points(tracked: Markers) -> None:
    moving, _ = read_points(FORMATS[".csv"](tracked, "ada", "x"), names=None)
    assert moving["20"][:, :2] == pytest.approx(tracked.points[:, 19], abs=1e-4)
    content = json.loads(FORMATS[".json"](tracked, "ada", "x"))
    assert np.array(content["pixels"]) == pytest.approx(tracked.pixels, abs=0.01)
    assert content["feature_points"][19] == "9.3"
    assert len(read_fap(FORMATS[".fap"](tracked, "ada", "x")).values) == 30
    assert FORMATS[".bml"](tracked, "ada", "x").startswith("<")


def test_track_markers_numbers_any_other_markers() -> None:
    few = truth("ada", acted(8))[:, [3, 4, 19, 25, 26]]
    markers = track_markers(plain(few), MarkerSettings(COLOURS[:1]), "film")
    assert markers.layout.names == ("1", "2", "3", "4", "5")
    assert markers.pixels == pytest.approx(few, abs=1)
    with pytest.raises(TrackingError, match="wanted two feature points of MPEG-4 or more"):
        faps_of(markers)


def test_track_markers_puts_an_uneven_film_on_an_even_rate() -> None:
    shown = list(plain(truth("ada", acted(10))))
    late = [shown[k].__class__(k / 25 + (0.01 if k % 2 else 0), shown[k].image, "p") for k in range(10)]
    markers = track_markers(late, MarkerSettings(COLOURS, neutral=0), "film", fps=50)
    assert (markers.fps, len(markers.points)) == (50, 19)
    assert np.isfinite(markers.points).all()


def test_track_markers_says_what_was_found_instead() -> None:
    with pytest.raises(TrackingError, match=r"film: wanted markers of the colours red, found 0"):
        track_markers(plain(truth("ada", acted(2))), MarkerSettings((named("red"),)), "film")
    grey = [
        one.__class__(one.time, one.image.convert("L").convert("RGB"), one.name)
        for one in plain(truth("ada", acted(2)))
    ]
    with pytest.raises(
        TrackingError, match=r"film: wanted markers of the colours green, blue, found 0 in most"
    ):
        track_markers(grey, MarkerSettings(COLOURS), "film")
    with pytest.raises(TrackingError, match=r"wanted a picture from 0 to 1 as --neutral, got 9"):
        track_markers(plain(truth("ada", acted(2))), MarkerSettings(COLOURS, neutral=9), "film")
    with pytest.raises(TrackingError, match=r"wanted the 31 markers of the layout, found 5"):
        track_markers(plain(truth("ada", acted(2))[:, :5]), MarkerSettings(COLOURS, wojdel()), "film")


BLOB_COLOURS = (named("green"), named("blue"))


def picture(*boxes: tuple[int, int, int, int], blue: tuple[int, int, int, int] | None = None) -> Image.Image:
    image = Image.new("RGB", (200, 120), (196, 150, 125))
    pen = ImageDraw.Draw(image)
    for box in boxes:
        pen.rectangle(box, fill=(60, 190, 80))
    if blue is not None:
        pen.rectangle(blue, fill=(50, 80, 200))
    return image


def test_blobs_are_the_middles_of_markers() -> None:
    found = blobs(picture((10, 20, 16, 28), (100, 50, 106, 56)), BLOB_COLOURS)
    assert found == pytest.approx(np.array([[13, 24, 0], [103, 53, 0]]))


def test_blobs_narrower_than_three_pixels_are_noise() -> None:
    assert len(blobs(picture((10, 20, 40, 21), (100, 50, 101, 70)), BLOB_COLOURS)) == 0


def test_blobs_nearer_than_nine_pixels_are_one_marker() -> None:
    found = blobs(
        picture((10, 20, 12, 24), (17, 20, 19, 24), (40, 20, 44, 24), (49, 20, 53, 24)), BLOB_COLOURS
    )
    assert found[:, 0] == pytest.approx([14.5, 42, 51])


def test_blobs_of_painted_lids_are_at_the_upper_edge() -> None:
    (lid,) = blobs(picture(blue=(50, 30, 70, 36)), BLOB_COLOURS)
    assert lid == pytest.approx([60, 30, 1])


def test_blobs_outside_the_region_are_left_out() -> None:
    shown = picture((10, 20, 16, 28), (100, 50, 106, 56))
    assert blobs(shown, BLOB_COLOURS, (60, 0, 200, 120)) == pytest.approx(np.array([[103, 53, 0]]))
    assert blobs(shown, BLOB_COLOURS, (120, 0, 200, 120)).shape == (0, 3)
