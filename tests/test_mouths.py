"""The mouths of the faces that ship, as a client sees them at 25 frames a second, whatever the phase."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from itertools import accumulate

import numpy as np
import pytest

from realizer.animation.lips.visemes import coarticulation
from realizer.animation.pose import poses
from realizer.core.array_types import Float64
from realizer.face.load import load_face
from realizer.offline import realize
from realizer.speech.utterance import Phoneme, SpeechRequest, Utterance, Word
from tests.mouths import Mouth

FACES = ("ada", "ben", "ida")
SHOWN = ("", "HAPPINESS", "ANGER", "SURPRISE")
# Quick and slow, between open vowels, beside each other, first and last.
SAID = (
    "_ .4, p .05, ɑ .09, m .06, ɑ .12, b .04, ɑ .09, f .08, ɑ .12, v .05, ɑ .09, t .07, "
    "ɛ .13, m .05, f .06, ɛ .12, t .07, i .13, t .07, ɑ .13, m .07, _ .4"
)
START = 0.5  # s
STEP, FRAME = 0.01, 0.04  # s
LEAST = 0.06  # s; a shorter sound has a frame no further than half of this from its middle
MEETS, OVERLAP = 0.03, 0.02  # of the mouth-nose separation
Index = np.ndarray[tuple[int], np.dtype[np.intp]]


def phonemes() -> tuple[Phoneme, ...]:
    parts = [part.split() for part in SAID.split(",")]
    ends = [0.0, *accumulate(float(length) for _, length in parts)]
    return tuple(
        Phoneme(begin, end, ipa.replace("_", ""), 1)
        for (ipa, _), begin, end in zip(parts, ends, ends[1:], strict=False)
    )


class Said:
    """A voice that has said it already."""

    name = "said"

    def say(self, request: SpeechRequest) -> Utterance:
        end = phonemes()[-1].end
        return Utterance(end, (Word(0.4, end - 0.4, "x"),), phonemes(), {})

    def close(self) -> None:
        pass


@dataclass(frozen=True)
class Seen:
    """What a mouth did at `times`: see `Mouth`."""

    times: Float64
    gap: Float64
    bite: Float64
    path: Float64


@cache
def seen(face: str, shown: str) -> Seen:
    """At a hundred frames a second, from the start of the speech to its end."""
    mouth = Mouth(load_face(face))
    expression = f'<faceLexeme id="x" lexeme="{shown}" amount="0.8" start="0" end="9"/>' if shown else ""
    played = realize(
        f'<bml id="b">{expression}<speech id="s" start="{START}"><text>x</text></speech></bml>',
        voice=Said(),
        fps=1 / STEP,
        idle=False,
        face=face,
    )
    times = played.aus.times
    keep = (times > START) & (times < START + phonemes()[-1].end)
    vertices = mouth.vertices(poses(played.aus, mouth.face.inputs)[keep])
    return Seen(times[keep], mouth.gap(vertices), mouth.bite(vertices), mouth.path(vertices))


def grids(times: Float64, phoneme: Phoneme) -> list[Index]:
    """The frames of each phase that fall on a sound."""
    middle = START + (phoneme.start + phoneme.end) / 2
    half = max(LEAST, phoneme.end - phoneme.start) / 2
    inside = np.flatnonzero((times >= middle - half - 1e-9) & (times <= middle + half + 1e-9))
    phases = round(FRAME / STEP)
    return [inside[inside % phases == phase] for phase in range(phases)]


@pytest.mark.parametrize("shown", SHOWN)
@pytest.mark.parametrize("face", FACES)
def test_every_p_b_and_m_has_a_frame_in_which_the_lips_meet(face: str, shown: str) -> None:
    mouth = seen(face, shown)
    for phoneme in phonemes():
        if phoneme.ipa in ("p", "b", "m"):
            for grid in grids(mouth.times, phoneme):
                assert mouth.gap[grid].min() < MEETS, phoneme


@pytest.mark.parametrize("shown", SHOWN)
@pytest.mark.parametrize("face", FACES)
def test_in_every_f_and_v_the_lower_lip_reaches_the_teeth_and_they_show(face: str, shown: str) -> None:
    mouth = seen(face, shown)
    for phoneme in phonemes():
        if phoneme.ipa in ("f", "v"):
            for grid in grids(mouth.times, phoneme):
                assert mouth.bite[grid].min(axis=1).max() > OVERLAP, phoneme


@pytest.mark.parametrize("face", FACES)
def test_vowels_open_the_mouth_as_they_are_open(face: str) -> None:
    mouth = seen(face, "")
    opened = {
        ipa: max(mouth.gap[np.concatenate(grids(mouth.times, p))].max() for p in phonemes() if p.ipa == ipa)
        for ipa in ("ɑ", "ɛ", "i")
    }
    assert opened["ɑ"] > 1.2 * opened["ɛ"] > 1.3 * opened["i"] > 0.1


@pytest.mark.parametrize("face", FACES)
def test_no_lip_goes_faster_than_the_table_lets_it(face: str) -> None:
    path = seen(face, "").path
    frames = round(FRAME / STEP)
    steps = np.abs(path[frames:] - path[:-frames]) * 1024 / FRAME
    assert steps.max() <= coarticulation()["speed"]["lips"] * 1.001


@pytest.mark.parametrize("face", FACES)
def test_a_smile_stays_one_while_the_mouth_speaks(face: str) -> None:
    further = (seen(face, "HAPPINESS").path - seen(face, "").path)[:, 2]  # the left corner
    assert np.median(further[:, 1]) > 0.08
    assert np.median(further[:, 0]) > 0.02
