"""Blending of layers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.axis import AU_NAMES, Target, au, axis, fap, mask_channel
from realizer.animation.blend import REPLACING, blend
from realizer.animation.channel import Channel, Layer
from realizer.animation.fap.conversion import to_fap
from realizer.animation.idle.blinks import Blinks, OnsetMask
from realizer.animation.idle.idle_face import Idle, idle_face
from realizer.animation.idle.motion import Motion
from realizer.core.array_types import Float64

ONE = np.array([0.0])


def still(target: Target, value: float, layer: Layer = Layer.EXPRESSION) -> Channel:
    return Channel(target, ONE, np.array([value]), layer=layer, keeps_last=True)


def value_of(channels: list[Channel], target: Target, time: float = 0.0) -> float:
    return float(blend(channels, np.array([time])).values[0, target.column])


SMILE, NOD, GAZE, JAW = au(12, "LEFT")[0], au(54)[0], au(61)[0], fap(3)

targets = st.sampled_from(sorted(axis().values(), key=lambda target: target.column))


@st.composite
def channels(draw: st.DrawFn) -> Channel:
    start = draw(st.floats(0.0, 2.0))
    gaps = draw(st.lists(st.floats(0.05, 1.0), min_size=3, max_size=3))
    values = draw(st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4))
    return Channel(
        draw(targets),
        np.cumsum([start, *gaps]),
        np.array(values),
        layer=draw(st.sampled_from(Layer)),
        keeps_last=draw(st.booleans()),
    )


many = st.lists(channels(), max_size=12)
TIMES = np.arange(0, 5, 0.04)


@given(many, st.randoms(use_true_random=False))
def test_blend_ignores_the_order_of_channels(given: list[Channel], random: st.DataObject) -> None:
    other = list(given)
    random.shuffle(other)  # type: ignore[attr-defined]
    np.testing.assert_allclose(blend(given, TIMES).values, blend(other, TIMES).values, atol=1e-6)


@given(targets, st.lists(st.floats(0.0, 1.0), min_size=4, max_size=4), st.sampled_from(Layer))
def test_blend_of_one_channel_is_its_sample(target: Target, values: list[float], layer: Layer) -> None:
    channel = Channel(target, np.arange(4.0), np.array([0.0, *values[1:]]), layer=layer)
    got = blend([channel], np.arange(4.0)).values
    np.testing.assert_array_equal(got[:, target.column], channel.values.astype(np.float32))
    assert not np.delete(got, target.column, axis=1).any()


@given(many)
def test_blend_at_25_fps_is_every_second_frame_of_50(given: list[Channel]) -> None:
    fast, slow = np.arange(0, 5, 0.02), np.arange(0, 5, 0.02)[::2]
    np.testing.assert_array_equal(blend(given, fast).values[::2], blend(given, slow).values)


@given(many)
def test_blend_limits_action_units_and_masks(given: list[Channel]) -> None:
    values = np.delete(blend(given, TIMES).values, range(len(AU_NAMES()), len(AU_NAMES()) + 68), axis=1)
    assert values.min() >= 0
    assert values.max() <= 1


def test_blend_of_no_channels_is_zero() -> None:
    frames = blend([], TIMES)
    assert frames.values.shape == (len(TIMES), len(axis()))
    assert frames.values.dtype == np.float32
    assert not frames.values.any()
    assert blend([still(SMILE, 1)], np.array([])).values.shape == (0, len(axis()))


@pytest.mark.parametrize("layer", [Layer.IDLE, Layer.EXPRESSION, Layer.SPEECH])
def test_blend_shows_the_stronger_expression(layer: Layer) -> None:
    assert value_of([still(SMILE, 0.3, layer), still(SMILE, 0.6)], SMILE) == pytest.approx(0.6)


def test_blend_shows_a_mood_under_a_weaker_expression() -> None:
    assert value_of([still(SMILE, 0.5, Layer.BASE), still(SMILE, 0.2)], SMILE) == pytest.approx(0.5)


def test_blend_adds_rotations() -> None:
    nods = [still(NOD, 0.1, Layer.HEAD), still(NOD, 0.2, Layer.HEAD), still(NOD, 0.05, Layer.IDLE)]
    assert value_of(nods, NOD) == pytest.approx(0.35)


def test_blend_adds_faps() -> None:
    assert value_of([still(JAW, 100, Layer.SPEECH), still(JAW, 50, Layer.SPEECH)], JAW) == 150


def test_blend_crossfades_moods() -> None:
    old = still(SMILE, 0.6, Layer.BASE).faded(1.0, 2.0)
    new = Channel(SMILE, np.array([1.0, 2.0]), np.array([0.0, 0.6]), layer=Layer.BASE, keeps_last=True)
    values = blend([old, new], np.linspace(0.5, 2.5, 51)).values[:, SMILE.column]
    assert values == pytest.approx(0.6)


def test_blend_masks_the_base_gaze_but_not_idle_eyes() -> None:
    base, idle = still(GAZE, 0.5, Layer.BASE), still(GAZE, 0.02, Layer.IDLE)
    look = [still(GAZE, 0.2, Layer.GAZE), still(mask_channel("eyes"), 0.75, Layer.GAZE)]
    assert value_of([base, idle, *look], GAZE) == pytest.approx(0.5 * 0.25 + 0.02 + 0.2)


def test_blend_keeps_the_head_under_a_gaze_of_the_eyes() -> None:
    turned = au(51)[0]
    look = [still(GAZE, 0.2, Layer.GAZE), still(mask_channel("eyes"), 1.0, Layer.GAZE)]
    assert value_of([still(turned, 0.4, Layer.BASE), *look], turned) == pytest.approx(0.4)


def test_blend_masks_idle_motion_but_not_other_motion() -> None:
    motion = still(mask_channel("motion"), 0.75, Layer.BASE)
    face = [still(NOD, 0.4, Layer.IDLE), still(NOD, 0.2, Layer.HEAD), motion]
    assert value_of(face, NOD) == pytest.approx(0.4 * 0.25 + 0.2)


def lid_of(taking: Channel, draw: float, time: float) -> float:
    """Return how far a lid is shut if a blink with this draw is due from 1 to 1.3 s."""
    nothing, second = np.zeros((1, 1)), np.ones((1, 1))
    still = Motion(
        (NOD.column,),
        keys=ONE[None],
        lengths=second,
        poses=nothing,
        steps=nothing,
        way=np.zeros(1, int),
        jumps=ONE,
        durations=np.ones(1),
        points=nothing,
        leaps=nothing,
        aims=np.zeros((2, 1)),
        seed=0,
        number=0,
    )
    keys = np.array([0.0, 0.08, 0.13, 0.3])[:, None]
    idle = Idle(Blinks(np.array([1.0]), np.array([draw]), keys, np.ones(1), np.zeros(1)), still)
    return float(blend([taking], np.array([time]), idle=idle).values[0, au(45)[0].column])


@pytest.mark.parametrize(("taken", "comes"), [(0.0, True), (0.25, True), (0.5, False), (1.0, False)])
def test_blend_shows_a_blink_whole_or_not_at_all(taken: float, comes: bool) -> None:
    assert lid_of(still(mask_channel("blinks"), taken, Layer.BASE), 0.6, 1.1) == comes


def test_blend_finishes_a_blink_in_any_window() -> None:
    soon = Channel(
        mask_channel("blinks"), np.array([1.05, 1.1]), np.array([0.0, 1.0]), layer=Layer.BASE, keeps_last=True
    )
    assert lid_of(soon, 0.0, 1.1) == 1
    # The mask at its onset counts, although it ends before this window.
    gone = OnsetMask(mask_channel("blinks"), ONE, np.array([1.0]), layer=Layer.BASE, keeps_last=True).faded(
        1.02, 1.1
    )
    assert lid_of(gone, 0.0, 1.11) == 0


def test_blend_masks_idle_motion_in_part() -> None:
    idle, moves = (
        idle_face(0.0, 5.0, 3),
        [column for column, _ in enumerate(axis()) if column < len(AU_NAMES())],
    )
    moves = [column for column in moves if column not in {lid.column for lid in au(45)}]
    alone, less, still_ = (
        blend([still(mask_channel("motion"), taken, Layer.BASE)], TIMES, idle=idle).values[:, moves]
        for taken in (0.0, 0.75, 1.0)
    )
    assert alone.max() > 0.005
    np.testing.assert_allclose(less, alone / 4, atol=1e-6)
    assert not still_.any()


def test_blend_shows_amounts_of_documents_without_small_movements() -> None:
    times, frown, brow = np.arange(0, 60, 0.04), au(4)[0], au(1)[0]
    idle = idle_face(0.0, 60.0, 3, liveliness=1.0)
    shown = Channel(frown, np.array([0.0, 60.0]), np.full(2, 0.03), layer=Layer.EXPRESSION)
    alone, both = (blend(some, times, idle=idle).values for some in ([], [shown]))
    assert alone[:, frown.column].max() > 0.03
    assert both[:, frown.column] == pytest.approx(0.03)
    assert alone[:, brow.column].max() > 0.03
    assert not both[:, brow.column].any()
    np.testing.assert_array_equal(both[:, SMILE.column], alone[:, SMILE.column])


def test_blend_adds_a_document_to_idle_motion() -> None:
    idle = idle_face(0.0, 5.0, 3)
    alone, both = (blend(some, TIMES, idle=idle).values for some in ([], [still(NOD, 0.25, Layer.HEAD)]))
    np.testing.assert_allclose(both[:, NOD.column], alone[:, NOD.column] + 0.25, atol=1e-6)
    np.testing.assert_array_equal(np.delete(both, NOD.column, 1), np.delete(alone, NOD.column, 1))


def test_blend_shares_the_eyes_between_gazes() -> None:
    left = [still(GAZE, 0.6, Layer.GAZE), still(mask_channel("eyes"), 1.0, Layer.GAZE)]
    up = [still(au(63)[0], 0.4, Layer.GAZE), still(mask_channel("eyes"), 1.0, Layer.GAZE)]
    assert value_of(left + up, GAZE) == pytest.approx(0.3)
    assert value_of(left + left, GAZE) == pytest.approx(0.6)
    assert value_of(left + up, mask_channel("eyes")) == 1


def test_blend_replaces_lower_layers_by_direct_values() -> None:
    rises = np.array([0.0, 1.0])
    held = Channel(SMILE, rises / 10, rises / 10, layer=Layer.DIRECT, keeps_last=True, weight=rises)
    face = [still(SMILE, 0.8), held.faded(2.0, 2.3)]
    times = np.linspace(0, 3, 3001)
    values = blend(face, times).values[:, SMILE.column]
    assert values[0] == pytest.approx(0.8)
    assert values[(times > 0.1) & (times < 2.0)] == pytest.approx(0.1)
    assert values[-1] == pytest.approx(0.8)
    assert np.max(np.abs(np.diff(values))) < 0.02


def test_blend_replaces_rotations_by_direct_values() -> None:
    face = [still(NOD, 0.3, Layer.HEAD), still(NOD, 0.1, Layer.DIRECT)]
    assert value_of(face, NOD) == pytest.approx(0.1)


CORNER = fap(12)


@st.composite
def set_faps(draw: st.DrawFn) -> Channel:
    """A FAP that comes, stays and goes, as documents and clients set it."""
    times = np.cumsum(draw(st.lists(st.floats(0.1, 1.0), min_size=4, max_size=4)))
    there = np.array([0.0, 1.0, 1.0, 0.0])
    value = draw(st.floats(-200.0, 200.0))
    return Channel(CORNER, times, value * there, layer=draw(st.sampled_from(REPLACING)), weight=there)


def corner(channels: list[Channel], times: Float64) -> Float64:
    """The FAP as faces of MPEG-4 show it."""
    return to_fap(blend(channels, times)).values[:, 11].astype(float)


below = st.lists(
    st.builds(still, st.sampled_from([*au(12), *au(15), *au(20), CORNER]), st.floats(0, 1)), max_size=4
)


@given(below, set_faps())
def test_blend_replaces_a_fap_while_it_is_set(face: list[Channel], one: Channel) -> None:
    inside = np.linspace(one.times[1], one.times[2], 5)
    np.testing.assert_allclose(corner([*face, one], inside), one.values[1], atol=1e-3)
    outside = np.array([one.times[0], one.times[-1] + 0.01])
    np.testing.assert_allclose(corner([*face, one], outside), corner(face, outside), atol=1e-3)


@given(below, st.lists(set_faps(), min_size=1, max_size=4))
def test_blend_fades_set_faps_without_jumps(face: list[Channel], some: list[Channel]) -> None:
    times = np.arange(0.0, 4.2, 0.001)
    # The fastest change: all of it in the shortest rise, at 1.875 of the mean speed, in both directions.
    most = np.abs(corner([*face], times)).max() + sum(np.abs(one.values).max() for one in some)
    assert np.abs(np.diff(corner([*face, *some], times))).max() <= 4 * most * 1.875 * 0.001 / 0.1 + 1e-3


@given(below, st.lists(set_faps(), max_size=4), st.randoms(use_true_random=False))
def test_blend_ignores_the_order_of_set_faps(
    face: list[Channel], some: list[Channel], random: st.DataObject
) -> None:
    given = [*face, *some]
    other = list(given)
    random.shuffle(other)  # type: ignore[attr-defined]
    np.testing.assert_allclose(corner(given, TIMES), corner(other, TIMES), atol=1e-3)


def test_blend_prefers_a_client_to_a_document() -> None:
    face = [still(part, 0.8) for part in au(12)]
    document, client = still(CORNER, 50, Layer.FAPS), still(CORNER, -20, Layer.DIRECT)
    alone, both = (to_fap(blend(some, ONE)).values[0] for some in (face, [*face, document, client]))
    assert both[11] == -20
    assert alone[11] not in (0, -20)
    np.testing.assert_array_equal(np.delete(both, 11), np.delete(alone, 11))


def test_blend_shares_a_fap_in_one_layer() -> None:
    both = [still(CORNER, 50, Layer.FAPS), still(CORNER, 150, Layer.FAPS)]
    assert value_of(both, CORNER) == 100
