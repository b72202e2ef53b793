"""The weights of ARKit's blend shapes that show a face."""

import numpy as np
import pytest

from realizer.animation.arkit import ARKIT_NAMES, arkit, shape_faps
from realizer.animation.axis import AU_NAMES, axis, fap
from realizer.animation.frames import AUFrames
from realizer.offline import realize
from realizer.tables import faps

SAYS = "Hello my beautiful world, four blue boats have a very good view of the sea."
SPEECH = (
    '<bml id="a" xmlns="http://www.bml-initiative.org/bml/bml-1.0">'
    f'<speech id="s"><text>{SAYS}</text></speech></bml>'
)
UNITS = {"MNS": 0.022, "MW": 0.05, "ENS": 0.044, "IRISD": 0.011}  # about how many mm


def one(**shown: float) -> AUFrames:
    values = np.zeros((1, len(axis())), np.float32)
    for name, value in shown.items():
        values[0, axis()[name.removeprefix("AU")].column] = value
    return AUFrames(np.zeros(1), values)


def weights(frames: AUFrames) -> dict[str, float]:
    return dict(zip(ARKIT_NAMES(), arkit(frames).weights[0].tolist(), strict=True))


def seen(frames: AUFrames) -> dict[str, float]:
    return {name: weight for name, weight in weights(frames).items() if weight > 0.02}


def test_shape_faps_of_closed_lips_undo_those_of_a_jaw_that_stays_open():
    shapes = dict(zip(ARKIT_NAMES(), shape_faps(None), strict=True))
    left = np.flatnonzero(shapes["mouthClose"] + shapes["jawOpen"]) + 1
    assert 3 in left
    assert {*left.tolist()} <= {3, 14, 15}
    assert not shapes["mouthClose"][[2, 13, 14]].any()


@pytest.fixture(scope="module")
def spoken():
    return realize(SPEECH, idle=False, voice="silent")


def test_arkit_of_a_face_at_rest_is_zero():
    assert not arkit(one()).weights.any()


@pytest.mark.parametrize(
    ("shown", "wanted"),
    [
        ({"AU12L": 0.7}, {"mouthSmileLeft": 0.7}),
        ({"AU6R": 0.5}, {"cheekSquintRight": 0.5}),
        ({"AU1L": 0.4, "AU1R": 0.8}, {"browInnerUp": 0.6}),
        ({"AU45L": 1.0}, {"eyeBlinkLeft": 1.0}),
        ({"AU27": 0.5}, {"jawOpen": 0.5}),
        ({"AU24": 0.6}, {"mouthPressLeft": 0.6, "mouthPressRight": 0.6}),
    ],
)
def test_arkit_copies_action_units_with_a_shape(shown, wanted):
    assert seen(one(**shown)) == pytest.approx(wanted, abs=0.01)


def test_arkit_fits_action_units_without_a_shape():
    dropped = seen(one(AU26=1.0))
    assert 0.4 < dropped["jawOpen"] < 0.7  # the jaw falls half as far as at its widest
    closed = seen(one(AU43L=1.0))
    assert closed["eyeBlinkLeft"] > 0.95


def test_arkit_turns_eyes_and_head_like_the_faps():
    values = one().values.copy()
    for number, angle in ((23, 0.2), (24, 0.2), (25, -0.1), (26, -0.1), (48, 0.3), (49, -0.2), (50, 0.1)):
        values[0, fap(number).column] = angle * 1e5
    found = arkit(AUFrames(np.zeros(1), values))
    np.testing.assert_allclose(found.head, [[-0.2, 0.3, 0.1]], atol=1e-5)
    np.testing.assert_allclose(found.eyes, [[[0.2, -0.1], [0.2, -0.1]]], atol=1e-5)
    shown = dict(zip(ARKIT_NAMES(), found.weights[0].tolist(), strict=True))
    assert shown["eyeLookOutLeft"] > 0.2  # to the character's left
    assert shown["eyeLookInRight"] > 0.2
    assert shown["eyeLookUpLeft"] > 0.1
    assert shown["eyeLookInLeft"] == shown["eyeLookOutRight"] == shown["eyeLookDownLeft"] == 0


def test_arkit_of_speech_reproduces_its_faps(spoken):
    back = arkit(spoken.aus, spoken.mapping).weights @ shape_faps(spoken.mapping)
    scale = np.array([UNITS.get(row.unit, 0.0) for row in faps()])
    wanted, off = spoken.faps.values * scale, (back - spoken.faps.values) * scale
    mouth = [row.fap - 1 for row in faps() if row.group in (2, 8) and row.fap not in (14, 15)]
    assert np.abs(wanted[:, 2]).max() > 3  # mm: the jaw moves
    inside = spoken.faps.values[:, 44] < 150  # ARKit's only tongue is one that opens the jaw, too
    assert np.abs(off[inside, 2]).max() < 0.6
    assert np.abs(off[:, 2]).max() < 1
    # Half a millimetre at the points of the mouth, which move by five.
    assert np.sqrt((off[:, mouth] ** 2).mean()) < 0.5
    assert np.abs(off[:, mouth]).max() < 2
    inner = [3, 4, 7, 8, 9, 10]
    assert np.sqrt((off[:, inner] ** 2).mean()) < 0.2 * np.abs(wanted[:, inner]).max()


def test_arkit_reduces_a_smile_by_the_lips_of_speech(spoken):
    values = spoken.aus.values.copy()
    values[:, [AU_NAMES().index("12L"), AU_NAMES().index("12R")]] = 1
    smiling = arkit(AUFrames(spoken.aus.times, values), spoken.mapping).weights
    column = ARKIT_NAMES().index("mouthSmileLeft")
    lips = values[:, axis()["lips"].column]
    assert smiling[lips == 0, column].min() > 0.99
    assert 0.1 < smiling[lips > 0.9, column].mean() < 0.9


def test_arkit_converts_each_frame_by_itself(spoken):
    whole = arkit(spoken.aus, spoken.mapping).weights
    alone = [
        arkit(AUFrames(spoken.aus.times[k : k + 1], spoken.aus.values[k : k + 1]), spoken.mapping).weights[0]
        for k in (0, 20, 40)
    ]
    np.testing.assert_allclose(alone, whole[[0, 20, 40]], atol=1e-6)
    assert whole.min() >= 0
    assert whole.max() <= 1
