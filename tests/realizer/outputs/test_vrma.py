"""VRM animations, as three-vrm reads them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from realizer.animation.arkit import arkit
from realizer.animation.axis import axis
from realizer.animation.frames import AUFrames
from realizer.offline import realize
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS
from realizer.outputs.vrma import encode_vrma, expressions
from realizer.tables.lexemes import face_lexemes

pytestmark = pytest.mark.xdist_group("outputs")

PRESETS = {"aa", "ih", "ou", "ee", "oh", "blinkLeft", "blinkRight", "happy", "angry", "sad", "surprised"}


@pytest.fixture(scope="module")
def played(turn):
    return realize(turn, voice="silent")


def one(realization, **shown: float):
    """Return the realization with a single frame of these action units."""
    values = np.zeros((1, len(axis())), np.float32)
    for name, value in shown.items():
        values[0, axis()[name.removeprefix("AU")].column] = value
    (name, performance) = next(iter(realization.characters.items()))
    frames = AUFrames(np.zeros(1), values)
    return replace(realization, characters={name: replace(performance, aus=frames)}, speeches=())


def seen(realization):
    return {
        name: float(weights[0]) for name, weights in expressions(realization).items() if weights[0] > 0.02
    }


def test_vrma_is_read_by_three_vrm(played, tmp_path, read_by):
    OUTPUTS[".vrma"].write(played, tmp_path / "x.vrma", RenderSettings())
    read = read_by("vrma.mjs", tmp_path / "x.vrma")
    assert read["warnings"] == []
    assert read["issues"]["numErrors"] == read["issues"]["numWarnings"] == 0
    # The validator does not know the extension, nor what its nodes are for, and says so; nothing else.
    assert {issue["code"] for issue in read["issues"]["messages"]} <= {"UNSUPPORTED_EXTENSION", "NODE_EMPTY"}
    assert set(read["preset"]) == PRESETS
    assert read["custom"] == {}
    assert read["hips"][1] == pytest.approx(0.9)
    for name, weights in expressions(played).items():
        assert read["preset"][name]["values"] == pytest.approx(weights.tolist(), abs=1e-6)
        assert read["preset"][name]["times"] == pytest.approx(played.aus.times.tolist(), abs=1e-6)
    frames = arkit(played.aus, played.mapping)
    assert set(read["turns"]) == {"head"}
    head = Rotation.from_quat(np.reshape(read["turns"]["head"]["values"], (-1, 4))).as_euler("YXZ")
    np.testing.assert_allclose(head, frames.head, atol=1e-5)
    look = Rotation.from_quat(np.reshape(read["look"], (-1, 4))).as_euler("YXZ")
    np.testing.assert_allclose(look[:, :2], frames.eyes.mean(axis=1), atol=1e-5)
    assert np.abs(look[:, 0]).max() > 0.05


@pytest.mark.parametrize(("text", "vowel"), [("bar bar", "aa"), ("bee bee", "ih"), ("boom boom", "ou")])
def test_vrma_vowels_are_those_of_the_speech(text, vowel):
    document = (
        '<bml id="a" xmlns="http://www.bml-initiative.org/bml/bml-1.0">'
        f'<speech id="s"><text>{text}</text></speech></bml>'
    )
    found = expressions(realize(document, voice="silent", idle=False, fps=50))
    mouth = {name: found[name] for name in ("aa", "ih", "ou", "ee", "oh")}
    assert max(mouth, key=lambda name: mouth[name].max()) == vowel
    # Between its vowels the lips close.
    wide = np.flatnonzero(found[vowel] > 0.6)
    assert sum(mouth.values())[wide[0] : wide[-1]].min() < 0.05


@pytest.mark.parametrize(
    ("name", "lexeme"),
    [("happy", "HAPPINESS"), ("angry", "ANGER"), ("sad", "SADNESS"), ("surprised", "SURPRISE")],
)
def test_vrma_expressions_are_those_of_emotions(realization, name, lexeme):
    shown = {}
    for (unit, side), amount in face_lexemes()[lexeme].aus.items():
        for suffix in ("",) if str(unit) in axis() else {"BOTH": "LR", "LEFT": "L", "RIGHT": "R"}[side]:
            shown[f"AU{unit}{suffix}"] = 0.6 * min(amount, 1.0)
    found = seen(one(realization, **shown))
    found = {key: value for key, value in found.items() if key not in ("blinkLeft", "blinkRight")}
    assert found == {name: pytest.approx(0.6, abs=0.03)}


def test_vrma_blinks_each_eye_by_itself(realization):
    assert seen(one(realization, AU45L=1.0)) == {"blinkLeft": pytest.approx(1, abs=0.05)}
    assert seen(one(realization)) == {}


def test_vrma_is_deterministic(played):
    assert encode_vrma(played) == encode_vrma(played)
