"""The output .talkinghead.json: the arguments of TalkingHead's `speakAudio`."""

import base64
from collections.abc import Iterable
from dataclasses import replace
from typing import Any

import numpy as np

from realizer.animation.arkit import ARKIT_NAMES, arkit
from realizer.animation.lips.viseme_weights import oculus_visemes
from realizer.outputs import speech_spans
from realizer.outputs.json_text import json_line
from realizer.outputs.output import text_output
from realizer.outputs.speech_spans import Span
from realizer.realization import Realization

RATE = 22050  # Hz; TalkingHead's default for PCM
# Ready Player Me's names of visemes that differ from those of Oculus.
NAMES = {"ih": "I", "oh": "O", "ou": "U"}
# Visemes move the mouth; of its ARKit shapes only those of its corners, which expressions use, are written.
MOUTH, CORNERS = ("jaw", "mouth", "tongue"), ("mouthSmile", "mouthFrown", "mouthDimple")
# TalkingHead has one value for both eyes.
BOTH = {"eyeLookDownLeft": "eyesLookDown", "eyeLookUpLeft": "eyesLookUp"}
HEAD = ("headRotateY", "headRotateX", "headRotateZ")  # radians: yaw, pitch, roll
NEGLIGIBLE = 0.005  # values that never exceed it are omitted


def encode_talkinghead(realization: Realization) -> str:
    """Return a line of JSON: the properties of the first argument of `speakAudio`; times in milliseconds.

    `words` and `visemes` have times and durations; `anim` is the animation of the rest of the face by frames;
    `markers` are names of sync points, to be replaced by functions; `audio`, to be passed as `[bytes]`, is
    base64 of 16-bit mono PCM at `sampleRate`.
    """
    own = tuple(s for s in realization.speeches if s.character == 0)
    words = [word for speaking in own for word in speech_spans.words(speaking)]
    names = {row.viseme: NAMES.get(row.name, row.name) for row in oculus_visemes()}
    visemes = [
        viseme
        for speaking in own
        for viseme in speech_spans.visemes(speaking, lambda viseme, _: names[viseme])
    ]
    points = sorted(speech_spans.points(realization))
    sound = replace(realization, speeches=own).sound(RATE)
    content = {
        **_timed("words", "w", words),
        **_timed("visemes", "v", visemes),
        "markers": [name for _, name in points],
        "mtimes": [_ms(time) for time, _ in points],
        "anim": _anim(realization),
        "sampleRate": RATE,
        "audio": base64.b64encode(sound.astype("<i2").tobytes()).decode(),
    }
    return json_line(content)


def _timed(name: str, letter: str, spans: Iterable[Span]) -> dict[str, Any]:
    spans = list(spans)
    return {
        name: [span.text for span in spans],
        f"{letter}times": [_ms(span.start) for span in spans],
        f"{letter}durations": [_ms(span.end - span.start) for span in spans],
    }


def _anim(realization: Realization) -> dict[str, Any]:
    """Return the animation without frame 0, because value k is reached after the first k + 1 of `dt`."""
    frames = arkit(realization.aus, realization.mapping)
    values = {
        BOTH.get(name, name): column
        for name, column in zip(ARKIT_NAMES(), frames.weights.T, strict=True)
        if name.startswith(CORNERS) or not name.startswith(MOUTH)
        if name not in ("eyeLookDownRight", "eyeLookUpRight")
    } | dict(zip(HEAD, frames.head.T, strict=True))
    dt = np.diff(np.round(frames.times * 1000, 3)).round(3).tolist()
    shown = {
        name: [round(value, 3) + 0.0 for value in column[1:].tolist()]
        for name, column in values.items()
        if np.abs(column).max() > NEGLIGIBLE
    }
    return {"name": "performance", "dt": dt, "vs": shown if dt else {}}


def _ms(seconds: float) -> float:
    return round(seconds * 1000, 1)


TALKINGHEAD = text_output(
    ".talkinghead.json",
    "application/json",
    "words, visemes, face and sound for TalkingHead",
    encode_talkinghead,
)
