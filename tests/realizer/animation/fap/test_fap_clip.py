"""FAP clips at other rates, and cut."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.frames import FAPFrames


def clip(jaw: list[int], fps: float = 25.0) -> FAPClip:
    count = len(jaw)
    values = np.zeros((count, 68), np.int32)
    values[:, 2] = jaw
    visemes = np.zeros((count, 4), np.int32)
    visemes[:, 0] = np.arange(count) % 15
    return FAPClip("x", fps, values, np.arange(68) < 3, visemes, np.zeros((count, 6), np.int32))


def test_resampled_to_twice_the_rate_interpolates() -> None:
    got = clip([0, 10, 20]).resampled(50)
    assert (got.fps, got.values[:, 2].tolist()) == (50, [0, 5, 10, 15, 20])


def test_resampled_to_half_the_rate_drops_every_second_frame() -> None:
    assert clip([0, 10, 20, 30, 40]).resampled(12.5).values[:, 2].tolist() == [0, 20, 40]


def test_resampled_takes_visemes_of_the_nearest_frame() -> None:
    assert clip([0, 0, 0]).resampled(100).visemes[:, 0].tolist() == [0, 0, 0, 1, 1, 1, 2, 2, 2]


@given(
    st.lists(st.integers(-4000, 4000), min_size=1, max_size=60),
    st.sampled_from([2.0, 5.0, 12.5, 25.0, 29.97, 30.0, 60.0]),
    st.integers(1, 8),
)
def test_resampled_to_a_multiple_and_back_changes_nothing(jaw: list[int], fps: float, times: int) -> None:
    original = clip(jaw, fps)
    again = original.resampled(fps * times).resampled(fps)
    assert again == original


@given(st.lists(st.integers(-4000, 4000), min_size=2, max_size=60), st.floats(0.5, 240))
def test_resampled_keeps_the_length_and_the_range_of_values(jaw: list[int], fps: float) -> None:
    original = clip(jaw)
    got = original.resampled(fps)
    assert 0 <= (len(jaw) - 1) / 25 - (len(got.values) - 1) / fps < 1 / fps + 1e-6
    assert min(jaw) <= got.values[:, 2].min() <= got.values[:, 2].max() <= max(jaw)
    assert got.values[0, 2] == jaw[0]


@pytest.mark.parametrize("jaw", [[], [7]])
def test_resampled_keeps_a_single_frame(jaw: list[int]) -> None:
    assert clip(jaw).resampled(60).values[:, 2].tolist() == jaw


@pytest.mark.parametrize("fps", [0, -1, float("nan"), float("inf")])
def test_resampled_refuses_invalid_rates(fps: float) -> None:
    with pytest.raises(ValueError, match="fps: wanted a number above 0, got"):
        clip([0, 1]).resampled(fps)


def test_from_frame_keeps_rate_and_visemes() -> None:
    got = clip([1, 2, 3], 30).from_frame(1)
    assert (got.fps, got.values[:, 2].tolist(), got.visemes[:, 0].tolist()) == (30, [2, 3], [1, 2])


def test_frames_hold_the_faps_of_the_clip_except_1_and_2() -> None:
    frames = clip([0, 10, 20], 50.0).frames()
    assert frames.times.tolist() == [0, 0.02, 0.04]
    assert frames.values[:, 2].tolist() == [0, 10, 20]
    assert np.flatnonzero(frames.mask).tolist() == [2]


def test_clip_of_frames_is_rounded_and_leaves_out_faps_1_and_2() -> None:
    values = np.zeros((2, 68), np.float32)
    values[:, :4] = 7.6
    made = FAPClip.of(FAPFrames(np.array([0.0, 0.04]), values, np.arange(68) < 3), 25.0, "x")
    assert made.values[:, :4].tolist() == [[0, 0, 8, 0]] * 2
    assert np.flatnonzero(made.mask).tolist() == [2]
    assert (made.name, made.fps) == ("x", 25.0)
