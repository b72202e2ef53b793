"""Contact sheets and stills of a realization."""

from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from realizer.outputs.output import RenderSettings
from realizer.outputs.png import moments, row_at
from realizer.outputs.registry import OUTPUTS
from realizer.scheduling.timing import Schedule


def test_moments_include_first_last_and_sync_points(realization):
    shown = moments(realization)
    assert shown[0].frame == 0
    assert shown[-1].frame == 37
    named = {m.frame: m.points for m in shown if m.points}
    assert named == {5: ("nod:start",), 20: ("nod:stroke",), 35: ("nod:end",)}
    assert [m.frame for m in shown] == sorted({m.frame for m in shown})
    assert 8 <= len(shown) <= 24


def test_moments_are_at_most_24(realization):
    times = np.linspace(0, 1.4, 36)
    crowd = Schedule("b", {"g": tuple(f"stroke:{k}" for k in range(36))}, {"g": times})
    shown = moments(replace(realization, schedules=(crowd,)))
    assert len(shown) == 24
    assert (shown[0].frame, shown[-1].frame) == (0, 37)
    assert max(np.diff([m.frame for m in shown])) <= 5


@pytest.mark.parametrize(("seconds", "frame"), [(0, 0), (0.4, 10), (-1, 0), (99, 37)])
def test_row_at_a_frame_is_that_frame(realization, seconds, frame):
    assert row_at(realization, seconds) == pytest.approx(realization.poses[frame], rel=1e-5, abs=1e-3)


def test_row_at_a_time_between_frames_is_interpolated(realization):
    wanted = realization.poses[10:12].mean(0)
    assert row_at(realization, 0.42) == pytest.approx(wanted, rel=1e-4, abs=0.01)


def drawn(realization, path, drawing) -> np.ndarray:
    OUTPUTS[".png"].write(realization, path, drawing)
    return np.asarray(Image.open(io.BytesIO(path.read_bytes())))


@pytest.mark.gl
@pytest.mark.slow
def test_png_at_an_instant_is_one_picture(realization, tmp_path, rendering):
    settings = rendering((97, 96))
    picture, later = (
        drawn(realization, tmp_path / "x.png", replace(settings, at=seconds)) for seconds in (0.4, 0.8)
    )
    assert picture.shape == (96, 97, 3)
    assert picture.std() > 15
    assert not np.array_equal(picture, later)


@pytest.mark.gl
@pytest.mark.parametrize("at", [None, 0.4])
@pytest.mark.slow
def test_output_begin_starts_a_renderer(realization, tmp_path, at):
    drawing = RenderSettings((160, 120), at=at)
    early = OUTPUTS[".png"].begin(drawing, realization.face_name, realization.deformer)
    assert early.renderer is not None
    started = early.renderer.pid
    assert started is not None
    size, alpha = ((160, 120), True) if at is not None else ((80, 60), False)
    assert early.make_renderer(realization, size, realization.face_name, alpha=alpha).pid == started
    picture = drawn(realization, tmp_path / "x.png", early)
    assert np.array_equal(picture, drawn(realization, tmp_path / "y.png", drawing))
    assert (picture.shape == (120, 160, 3)) if at is not None else (picture.shape[1] > 3 * 80)


def test_output_begin_starts_nothing_without_pictures(realization):
    drawing = RenderSettings()
    assert OUTPUTS[".fap"].begin(drawing, realization.face_name) is drawing
