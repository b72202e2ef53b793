"""The output .talkinghead.json: the arguments of TalkingHead's `speakAudio`."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from realizer.animation.arkit import ARKIT_NAMES, arkit
from realizer.animation.lips.viseme_weights import oculus_visemes
from realizer.animation.lips.visemes import sounds
from realizer.outputs import speech_spans
from realizer.outputs.output import Output, RenderSettings
from realizer.outputs.speech_spans import Span

if TYPE_CHECKING:
    from realizer.playback.active_block import ScheduledSpeech
    from realizer.realization import Realization

RATE = 22050  # Hz; what TalkingHead takes PCM for where nobody says otherwise
# Ready Player Me's names of these visemes, where they are not those of Oculus.
NAMES = {"ih": "I", "oh": "O", "ou": "U"}
# Shapes of the mouth are left to the visemes, but for those by which an expression bends its corners.
MOUTH, CORNERS = ("jaw", "mouth", "tongue"), ("mouthSmile", "mouthFrown", "mouthDimple")
# Both eyes look up and down by one value there.
BOTH = {"eyeLookDownLeft": "eyesLookDown", "eyeLookUpLeft": "eyesLookUp"}
HEAD = ("headRotateY", "headRotateX", "headRotateZ")  # radians: yaw, pitch, roll
SEEN = 0.005  # a value that never comes so far is left out


def encode_talkinghead(realization: Realization) -> str:
    """One line of JSON: the properties of the first argument of `speakAudio`; times in milliseconds.

    `words` and `visemes` with their times and durations; `anim`, what the face does beside speaking, a frame
    each; `markers` the names of sync points, to be replaced by functions where they are wanted; `audio`, to
    be handed over as `[bytes]`, is base64 of 16-bit mono PCM at `sampleRate`.
    """
    mine = tuple(s for s in realization.speeches if s.character == 0)
    words = [word for speaking in mine for word in speech_spans.words(speaking)]
    visemes = [viseme for speaking in mine for viseme in _visemes(speaking)]
    points = speech_spans.points(realization)
    sound = replace(realization, speeches=mine).sound(RATE)
    content = {
        **_timed("words", "w", words),
        **_timed("visemes", "v", visemes),
        "markers": [name for _, name in points],
        "mtimes": [_ms(time) for time, _ in points],
        "anim": _anim(realization),
        "sampleRate": RATE,
        "audio": base64.b64encode(sound.astype("<i2").tobytes()).decode(),
    }
    return json.dumps(content, ensure_ascii=False, allow_nan=False, separators=(",", ":")) + "\n"


def _encode(realization: Realization, drawing: RenderSettings) -> bytes:
    return encode_talkinghead(realization).encode()


def _timed(name: str, letter: str, spans: Iterable[Span]) -> dict[str, Any]:
    spans = list(spans)
    return {
        name: [span.text for span in spans],
        f"{letter}times": [_ms(span.start) for span in spans],
        f"{letter}durations": [_ms(span.end - span.start) for span in spans],
    }


def _visemes(speaking: ScheduledSpeech) -> Iterator[Span]:
    """The strongest viseme of each sound; neighbours that are the same are one."""
    names = {row.viseme: NAMES.get(row.name, row.name) for row in oculus_visemes()}
    now: Span | None = None
    for phoneme in speech_spans.phonemes(speaking):
        start = phoneme.start
        for sound in sounds(phoneme.text):
            end = start + sound.share * (phoneme.end - phoneme.start)
            if sound.mix:
                name = names[max(sound.mix, key=lambda part: part[1])[0]]
                if now is not None and now.text == name and start - now.end < speech_spans.LEAST:
                    now = replace(now, end=end)
                else:
                    if now is not None:
                        yield now
                    now = Span(start, end, name)
            start = end
    if now is not None:
        yield now


def _anim(realization: Realization) -> dict[str, Any]:
    """Value k is reached after the first k + 1 of `dt`, so the frame at 0 is left out."""
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
        if np.abs(column).max() > SEEN
    }
    return {"name": "performance", "dt": dt, "vs": shown if dt else {}}


def _ms(seconds: float) -> float:
    return round(seconds * 1000, 1)


TALKINGHEAD = Output(
    ".talkinghead.json",
    "application/json",
    "words, visemes, face and sound for TalkingHead",
    _encode,
    reader="talkinghead.html",
)
