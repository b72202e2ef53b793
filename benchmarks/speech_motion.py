"""Prints how a face speaks, beside published figures of people: `python -m benchmarks.speech_motion`.

Each of `MOODS` is shown while twenty sentences are spoken by several voices, on several faces, at 100 frames
a second. A row is a measure of `MEASURES`, a column a mood. "ours" as a source is an aim that was chosen by
eye.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any
from xml.sax.saxutils import escape

import numpy as np

from benchmarks.lips import SENTENCES
from benchmarks.motion import DEGREES, FPS, MOVING, Row, print_measures, runs
from realizer.animation.axis import AU_NAMES
from realizer.animation.pose import poses
from realizer.core.errors import RealizerError
from realizer.face.load import load_face
from realizer.offline import realize
from realizer.playback.scheduled_speech import ScheduledSpeech
from realizer.realization import Realization
from realizer.speech.melody import RATE, Levels, melody
from realizer.speech.registry import find_voice
from realizer.tables import faps
from tests.mouths import Mouth

MOODS = {"neutral": "", "angry": "ANGER", "sad": "SADNESS", "joyful": "JOY"}
TEXTS = [line.strip() for line in SENTENCES["en-US"].splitlines()][::2]
VOICES = "espeak,espeak:en-gb+f3,hibari"
BML = (
    '<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="b{k}" composition="APPEND">{shown}'
    '<speech id="s" start="0.5"><text>{text}</text></speech><wait id="w" start="s:end" duration="0.7"/></bml>'
)
SHOWN = '<faceLexeme id="m" lexeme="{}" amount="0.8" start="0" attackPeak="0.45" end="w:end"/>'
VOWELS = {"a": "aɑæ", "e": "eɛ", "i": "iɪ", "u": "uʊ"}
ROUND, SPREAD = "uowʊ", "iɪ"
TURNS = ("pitch", "yaw", "roll")
ONSETS = [name for name in AU_NAMES() if name[-1] == "L" and int(name[:-1]) < 40]
SYLLABLE = 0.3  # s
SEEN = 0.2  # of an AU whose onset is looked at


@dataclass(frozen=True)
class Film:
    """A face that speaks `TEXTS`."""

    played: Realization
    mouth: Mouth

    @cached_property
    def units(self) -> dict[str, Any]:
        """The AUs that are shown, (n,) 0..1 by name."""
        return dict(zip(AU_NAMES(), self.played.aus.moving, strict=True))

    @cached_property
    def turns(self) -> Any:
        """Pitch, yaw and roll of the head, (3, n) degrees."""
        columns = {row.name: row.fap - 1 for row in faps()}
        return np.stack([self.played.faps.values[:, columns[f"head_{way}"]] * DEGREES for way in TURNS])

    @cached_property
    def speed(self) -> Any:
        """Degrees a second of the head, (n,)."""
        return np.linalg.norm(np.gradient(self.turns, 1 / FPS, axis=1), axis=0)

    @cached_property
    def path(self) -> Any:
        """Middles of both lips and both corners in mm on a head that does not turn, (n, 4, 3)."""
        face = self.mouth.face
        rows = poses(self.played.aus, face.inputs)
        rows[:, 47:50] = 0
        points = [face.feature_points[name] for name in ("2.2", "2.3", "2.4", "2.5")]
        parts = np.array_split(rows, len(rows) // 500 + 1)
        return 1000 * np.concatenate([self.mouth.vertices(part)[:, points] for part in parts])

    @property
    def gap(self) -> Any:
        return np.maximum(self.path[:, 0, 1] - self.path[:, 1, 1], 0)

    def sounds(self) -> Iterator[tuple[str, int, slice]]:
        """Yield the IPA, the stress and the frames of each sound."""
        for speech in self.played.speeches:
            for sound in speech.utterance.phonemes:
                first, last = (round((speech.start + at) * FPS) for at in (sound.start, sound.end))
                yield sound.ipa, sound.stress, slice(first, last + 1)

    def frames(self, speech: ScheduledSpeech) -> slice:
        """Return the frames of an utterance, from its first to its last sound."""
        heard = [p for p in speech.utterance.phonemes if p.ipa]
        return slice(
            round((speech.start + heard[0].start) * FPS), round((speech.start + heard[-1].end) * FPS)
        )

    def speaking(self, values: Any) -> Any:
        """Return the values (..., n) while somebody speaks, (..., m)."""
        return np.concatenate([values[..., self.frames(speech)] for speech in self.played.speeches], axis=-1)

    def heard(self) -> Iterator[tuple[slice, Any, Any]]:
        """Yield the frames, the loudness and the pitch of each utterance that has sound."""
        for speech in self.played.speeches:
            if speech.utterance.pcm is not None:
                frames, tune = self.frames(speech), melody(speech.utterance)
                at = np.arange(frames.start, frames.stop) / FPS - speech.start
                places = np.arange(len(tune.pitch)) / RATE
                sides = np.stack([at - 0.02, at + 0.02], axis=1)
                yield frames, Levels(speech.utterance).of(sides), np.interp(at, places, tune.pitch)


def smoothed(values: Any) -> Any:
    """Return the values without what is faster than syllables, which heads do not follow."""
    bell = np.hanning(round(SYLLABLE * FPS))
    return np.convolve(values, bell / bell.sum(), "same")


Measure = Callable[[list[Film]], str]


def number(values: Any, digits: int = 1) -> str:
    return f"{np.mean(values):.{digits}f}" if len(values) else "-"


def correlation(of: Callable[[Film], Any], loudness: bool, smooth: Callable[[Any], Any]) -> Measure:
    """Return a measure of the mean correlation of values with loudness, or with pitch, in each utterance."""

    def measure(films: list[Film]) -> str:
        found = []
        for film in films:
            values = of(film)
            for frames, loud, pitch in film.heard():
                found.append(np.corrcoef(values[frames], smooth(loud if loudness else pitch))[0, 1])
        return number(found, 2)

    return measure


def explained(films: list[Film]) -> str:
    """Measure the part of the variance of pitch that the rotation of the head and its speed explain."""
    found = []
    for film in films:
        moved = np.concatenate([film.turns, np.gradient(film.turns, axis=1), np.ones((1, len(film.speed)))])
        for frames, _, pitch in film.heard():
            rest = pitch - moved[:, frames].T @ np.linalg.lstsq(moved[:, frames].T, pitch, rcond=None)[0]
            found.append(1 - rest.var() / max(pitch.var(), 1e-9))
    return number(found, 2)


def ranges(films: list[Film]) -> str:
    each = [np.ptp(film.turns[:, film.frames(s)], axis=1) for film in films for s in film.played.speeches]
    return " ".join(f"{value:.1f}" for value in np.mean(each, axis=0))


def moving(films: list[Film]) -> str:
    return f"{100 * np.mean([np.mean(film.speaking(film.speed) > MOVING) for film in films]):.0f} %"


def opening(films: list[Film]) -> str:
    gaps = np.concatenate([film.speaking(film.gap) for film in films])
    return f"{gaps.mean():.1f} / {np.quantile(gaps, 0.95):.1f}"


def by_vowel(films: list[Film]) -> str:
    found = {name: list[float]() for name in VOWELS}
    for film in films:
        gap = film.gap
        for ipa, stress, frames in film.sounds():
            for name, letters in VOWELS.items():
                if ipa[:1] and ipa[0] in letters and len(ipa.rstrip("ː")) == 1 and stress:
                    found[name].append(gap[frames].max())
    return " ".join(number(values) for values in found.values())


def rounding(films: list[Film]) -> str:
    """Measure width, and how far the upper lip is forward, of rounded sounds and of /i/."""
    found: dict[str, list[Any]] = {ROUND: [], SPREAD: []}
    for film in films:
        path, rest = film.path, film.mouth.face.points["2.2"][2] * 1000
        for ipa, _, frames in film.sounds():
            for letters in found:
                if ipa[:1] and ipa[0] in letters and len(ipa.rstrip("ː")) == 1:
                    middle = path[(frames.start + frames.stop) // 2]
                    found[letters].append((middle[2, 0] - middle[3, 0], middle[0, 2] - rest))
    each = [np.mean(values, axis=0) if values else None for values in found.values()]
    return ", ".join("-" if one is None else f"{one[0]:.0f} {one[1]:+.1f}" for one in each)


def lip_speed(films: list[Film]) -> str:
    speeds = [np.linalg.norm(np.diff(film.path[:, :2], axis=0), axis=2).max(axis=1) * FPS for film in films]
    return f"{np.quantile(np.concatenate(speeds), 0.95):.0f} / {max(map(np.max, speeds)):.0f}"


def closed(films: list[Film]) -> str:
    found = [
        film.gap[frames].min() < 0.5
        for film in films
        for ipa, _, frames in film.sounds()
        if ipa[:1] in ("p", "b", "m")
    ]
    return f"{sum(found)}/{len(found)}"


def sides(films: list[Film]) -> str:
    """Measure the difference of left and right, as a part of the stronger side, of AUs above `SEEN`."""
    found = [np.zeros(0)]
    for film in films:
        for name in ONSETS:
            left, right = film.units[name], film.units[f"{name[:-1]}R"]
            most = np.maximum(left, right)
            found.append((np.abs(left - right) / np.maximum(most, 1e-9))[most > SEEN])
    return f"{100 * values.mean():.0f} %" if len(values := np.concatenate(found)) else "-"


def staggered(films: list[Film]) -> str:
    """Measure the ms between the first and the last AU of an expression that gets half of its way."""
    found = []
    for film in films:
        for speech in film.played.speeches:
            before = slice(round((speech.start - 0.5) * FPS), round(speech.start * FPS) + 20)
            tops = [film.units[name][before] for name in ONSETS]
            halves = [(top > top.max() / 2).argmax() for top in tops if top.max() > SEEN and top[0] < 0.05]
            found += [10 * (max(halves) - min(halves))] if len(halves) > 1 else []
    return number(found, 0)


def brows(films: list[Film]) -> str:
    """Measure raises of the brows a minute, and their sizes."""
    sizes, minutes = [], 0.0
    for film in films:
        for speech in film.played.speeches:
            raised = film.units["2L"][film.frames(speech)]
            minutes += len(raised) / FPS / 60
            raised = raised - np.minimum(raised[0], raised.min())
            sizes += [raised[a:b].max() for a, b in runs(raised > 0.08)]
    return f"{len(sizes) / minutes:.0f}, {number(sizes, 2)} sd {np.std(sizes or [0.0]):.2f}"


MEASURES: list[Row] = [
    ("head speed with loudness, r", "above 0", "Hadar 1983", correlation(lambda f: f.speed, True, smoothed)),
    ("head speed with pitch, r", "above 0", "Hadar 1983", correlation(lambda f: f.speed, False, smoothed)),
    ("variance of pitch by head", "0.63", "Munhall 2004", explained),
    ("head pitch yaw roll, degrees", "3-6 2-4 1-3", "ours", ranges),
    ("time in motion", "near 90 %", "Hadar 1983", moving),
    ("lip gap mean / p95, mm", "5-8 / 10-14", "ours", opening),
    ("lip gap with loudness, r", "0.6", "ours", correlation(lambda f: f.gap, True, lambda loud: loud)),
    ("stressed a e i u, mm", "8-15 a, 2-5 i u", "Ostry 1997, jaw", by_vowel),
    ("width, forward: u o w; i", "+5 mm", "Abry 1986", rounding),
    ("p b m closed", "all", "Lofqvist 1997", closed),
    ("lips p95 / most, mm/s", "250 at most", "Ostry 1994, jaw", lip_speed),
    ("left against right", "3 to 15 %", "Schmidt 2006", sides),
    ("AUs apart at half, ms", "40 to 120", "ours", staggered),
    ("brow raises a minute, size", "varied", "Cave 1996", brows),
]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--faces", default="ada,ben,ida")
    parser.add_argument("--voices", default=VOICES, help="those that are installed of these")
    parser.add_argument("--sentences", type=int, default=len(TEXTS))
    options = parser.parse_args()
    mouths = [Mouth(load_face(name)) for name in options.faces.split(",")]
    films: dict[str, list[Film]] = {mood: [] for mood in MOODS}
    for name in options.voices.split(","):
        try:
            voice = find_voice(name)
        except RealizerError as error:
            print(f"without {name}: {error}")
            continue
        for mood, lexeme in MOODS.items():
            shown = SHOWN.format(lexeme) if lexeme else ""
            texts = enumerate(TEXTS[: options.sentences])
            documents = [BML.format(k=k, shown=shown, text=escape(text)) for k, text in texts]
            for mouth in mouths:
                played = realize(documents, voice=voice, fps=FPS, face=mouth.face.name)
                films[mood].append(Film(played, mouth))
        voice.close()
    print_measures("", films, MEASURES)


if __name__ == "__main__":
    main()
