"""Prints how a face moves, beside published figures of people: `python benchmarks/motion.py`.

Films are played without a clock, at 100 frames a second: `idle` (nothing to do), `talk` (sentences, one after
the other) and `gaze` (large turns of eyes and head). A measure is a row of `MEASURES`: the film that it looks
at, its name, what is known of people and from where, and a function of the films, one for each seed.

"ours" as the source of a figure is an aim that was chosen by eye, not a measurement of people.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from bml_schema import parse
from realizer.animation.axis import AU_NAMES
from realizer.animation.fap.conversion import to_fap
from realizer.behaviours.registry import VOCABULARY
from realizer.core.options import PlayOptions
from realizer.playback.player import Player
from realizer.playback.speaking import open_voice, submit_with_speech
from realizer.speech.accents import phrases
from realizer.tables import faps

FPS = 100
WINDOW = 1000  # frames computed at a time
DEGREES = float(np.degrees(1e-5))  # of a unit of the FAPs that turn
SEEN, MOVING, SACCADE = 0.03, 1.5, 15.0  # of a lid; degrees a second of a head, of an eye
SMALL = ("1L", "2L", "12L", "14L")
NEAR = 0.3  # s
SENTENCES = (
    "Hello, and welcome to the museum. My name is Ada, and I will be your guide today.",
    "Please feel free to ask me about anything, maybe a Roman vase, or five brave fishermen.",
    "Where would you like to begin? We have an hour, which is not long, but long enough.",
)
DIRECTIONS = (12, 18, 36, 45, 60)  # degrees


class Film:
    """The frames of one face.

    Attributes:
        units: name -> (n,) 0..1, the AUs that are shown.
        turns: name of a FAP that turns head or eyes -> (n,) degrees.
        marks: (seconds, degrees) of gaze shifts, or (seconds, 0) of ends of phrases.
        minutes: its length.
    """

    def __init__(self, player: Player, seconds: float, marks: Sequence[tuple[float, float]] = ()) -> None:
        self.marks, self.minutes, times = marks, seconds / 60, np.arange(round(seconds * FPS)) / FPS
        parts = [player.frames(part) for part in np.array_split(times, len(times) // WINDOW + 1)]
        self.units = dict(zip(AU_NAMES(), np.concatenate([part.aus for part in parts]).T, strict=True))
        found = np.concatenate([to_fap(part).values for part in parts])
        self.turns = {row.name: found[:, row.fap - 1] * DEGREES for row in faps() if row.unit == "angle_unit"}

    @cached_property
    def blinks(self) -> list[Blink]:
        left, right = self.units["45L"], self.units["45R"]
        return [Blink(a / FPS, left[a:b], right[a:b]) for a, b in runs(np.maximum(left, right) > SEEN)]

    def speed(self, *names: str) -> Any:
        """Return the degrees a second (n,) of turns together."""
        return np.hypot.reduce([np.gradient(self.turns[name], 1 / FPS) for name in names])


class Blink(NamedTuple):
    """A blink: its onset, and how far the left and the right lid are closed in its frames."""

    onset: float
    left: Any
    right: Any

    @property
    def milliseconds(self) -> float:
        return len(self.left) * 1000 / FPS

    @property
    def closing(self) -> float:
        """The milliseconds until 95 % of the greatest value."""
        return float((self.left >= 0.95 * self.left.max()).argmax()) * 1000 / FPS

    @property
    def faster(self) -> float:
        """The greatest speed of closing over that of opening."""
        return -float(np.diff(self.left).max() / np.diff(self.left).min())

    @property
    def lag(self) -> float:
        """The milliseconds between the two lids, from the areas under their closing halves."""
        top = int(self.left.argmax()) + 1
        return float(self.left[:top].sum() - self.right[:top].sum()) / float(self.left.max()) * 1000 / FPS


def runs(where: Any) -> Iterator[tuple[int, int]]:
    """Yield first and last + 1 of each stretch that is true."""
    edges = np.diff(np.concatenate([[0], where.astype(int), [0]]))
    return zip(np.flatnonzero(edges == 1).tolist(), np.flatnonzero(edges == -1).tolist(), strict=True)


def idle(seed: int, seconds: float, liveliness: float) -> Film:
    return Film(Player(PlayOptions(seed=seed, liveliness=liveliness)), seconds)


def talk(seed: int, seconds: float, liveliness: float) -> Film:
    player = Player(PlayOptions(seed=seed, liveliness=liveliness))
    with open_voice(None) as voice:
        for k, text in enumerate(SENTENCES[(k + seed) % len(SENTENCES)] for k in range(round(seconds / 6))):
            words = f'<bml id="b{k}" composition="APPEND"><speech id="s"><text>{text}</text></speech></bml>'
            submit_with_speech(player, parse(words, VOCABULARY), voice)
    ends = [(said.start + phrase.end, 0.0) for said in player.speech() for phrase in phrases(said.utterance)]
    return Film(player, player.end, ends)


def gaze(seed: int, seconds: float, liveliness: float) -> Film:
    player, starts = Player(PlayOptions(seed=seed, liveliness=liveliness)), np.arange(1.0, seconds - 4, 6.0)
    angles = np.resize(DIRECTIONS, len(starts)).tolist()
    gazes = "".join(
        f'<gaze id="g{k}" target="CAMERA" offsetAngle="{angle}" offsetDirection="{("LEFT", "RIGHT")[k % 2]}"'
        f' start="{start}" ready="{start + 0.5}" relax="{start + 3}" end="{start + 3.5}"/>'
        for k, (start, angle) in enumerate(zip(starts.tolist(), angles, strict=True))
    )
    player.submit(parse(f'<bml id="b">{gazes}</bml>', VOCABULARY), 0.0)
    return Film(player, seconds, [*zip(starts, angles, strict=True), *zip(starts + 3, angles, strict=True)])


FILMS: dict[str, Callable[[int, float, float], Film]] = {"idle": idle, "talk": talk, "gaze": gaze}


def of_blinks(value: Callable[[Blink], float], text: Callable[[Any], str]) -> Callable[[list[Film]], str]:
    """Return a measure of all blinks."""
    return lambda films: text(np.array([value(blink) for film in films for blink in film.blinks]))


def mean(values: Any, digits: int = 0) -> str:
    return f"{np.mean(values):.{digits}f}, sd {np.std(values):.{digits}f}" if len(values) else "none"


def share(values: Any) -> str:
    return f"{100 * np.mean(values):.0f} %" if len(values) else "none"


def a_minute(count: Callable[[Film], int]) -> Callable[[list[Film]], str]:
    return lambda films: f"{sum(map(count, films)) / sum(film.minutes for film in films):.1f}"


def rises(name: str, level: float) -> Callable[[list[Film]], str]:
    """Return a measure of how often an AU rises above a level."""
    return a_minute(lambda film: len(list(runs(film.units[name] > level))))


def gaps(films: list[Film]) -> Any:
    """Return the seconds from each blink to the next one."""
    return np.concatenate([np.diff([blink.onset for blink in film.blinks]) for film in films])


def with_blink(least: float, most: float) -> Callable[[list[Film]], str]:
    """Return a measure of the marks of a size near which a blink begins."""

    def measure(films: list[Film]) -> str:
        marks = [(film, at) for film in films for at, size in film.marks if least <= size <= most]
        return share([any(abs(blink.onset - at) <= NEAR for blink in film.blinks) for film, at in marks])

    return measure


def head_range(films: list[Film]) -> str:
    turns = [np.array([film.turns[f"head_{way}"] for film in films]) for way in ("pitch", "yaw", "roll")]
    return ", ".join(f"{turn.std(axis=1).mean():.1f} / {np.ptp(turn):.1f}" for turn in turns)


def head_still(films: list[Film]) -> str:
    return share([film.speed("head_pitch", "head_yaw", "head_roll") < MOVING for film in films])


def saccades(films: list[Film]) -> str:
    fast = [film.speed("yaw_l_eyeball", "pitch_l_eyeball") > SACCADE for film in films]
    return f"{sum(len(list(runs(film))) for film in fast) * FPS / sum(map(len, fast)):.2f}"


def small_movements(films: list[Film]) -> str:
    count = sum(len(list(runs(film.units[name] > 0.02))) for film in films for name in SMALL)
    return f"one every {60 * sum(film.minutes for film in films) / max(count, 1):.1f} s"


def deviations(films: list[Film]) -> str:
    return " ".join(
        f"{name[:-1]} {np.mean([film.units[name].std() for film in films]):.3f}" for name in SMALL
    )


def apart(films: list[Film]) -> str:
    pairs = [(film.units[name], film.units[f"{name[:-1]}R"]) for film in films for name in SMALL]
    return f"{max(np.abs(left - right).max() for left, right in pairs):.2f}"


# What is measured, what is known of people, the source, the measure of films.
Row = tuple[str, str, str, Callable[[Any], str]]
MEASURES: dict[str, list[Row]] = {
    "idle": [
        ("blinks a minute", "17", "Bentivoglio 1997", a_minute(lambda film: len(film.blinks))),
        ("length, ms", "334, sd 67", "VanderWerff 2003", of_blinks(lambda b: b.milliseconds, mean)),
        ("closing, ms", "75 to 100", "VanderWerff 2003", of_blinks(lambda b: b.closing, mean)),
        ("speed of closing over opening", "2", "Evinger 1991", of_blinks(lambda b: b.faster, mean)),
        ("partial", "10 to 20 %", "Doane 1980", of_blinks(lambda b: b.left.max() < 0.95, share)),
        ("s to the next one", "most 1 to 10", "Ponder 1927", lambda films: mean(gaps(films), 1)),
        ("sd of its logarithm", "skewed", "Ponder 1927", lambda films: f"{np.log(gaps(films)).std():.2f}"),
        ("double (< 0.7 s)", "some", "ours", lambda films: share(gaps(films) < 0.7)),
        ("lids apart, ms", "5 to 15", "ours", of_blinks(lambda b: abs(b.lag), mean)),
        ("breaths a minute (AU38)", "16.6, sd 2.8", "Tobin 1983", rises("38L", 0.06)),
        ("swallows a minute (AU24)", "0.3 to 1.2", "Lear 1965", rises("24", 0.12)),
        ("head pitch, yaw, roll: sd / range", "sd 1 to 2", "ours", head_range),
        ("head still (< 1.5 degrees/s)", "mostly", "Hadar 1983", head_still),
        ("saccades a second", "1 to 3", "Lee 2002", saccades),
        ("small movements (> 0.02)", "every few s", "ours", small_movements),
        ("sd of AUs", "above 0", "ours", deviations),
        ("left against right at most", "above 0", "ours", apart),
    ],
    "talk": [
        ("blinks a minute", "26", "Bentivoglio 1997", a_minute(lambda film: len(film.blinks))),
        ("blink near the end of a phrase", "mostly", "Nakano 2010", with_blink(0, 0)),
    ],
    "gaze": [
        ("blink at shifts over 33 degrees", "nearly all", "Evinger 1994", with_blink(33, 90)),
        ("blink at shifts under 20 degrees", "few", "Evinger 1994", with_blink(0, 20)),
    ],
}


def print_measures(title: str, films: Mapping[str, Any], rows: Iterable[Row]) -> None:
    """Print a row for each measure, with a column for each name of films, beside what is known of people."""
    heads = [title, *films, "people", "source"]
    cells = [
        [name, *(measure(f) for f in films.values()), people, source]
        for name, people, source, measure in rows
    ]
    widths = [max(map(len, column)) for column in zip(heads, *cells, strict=True)]
    for row in (heads, *cells):
        print("  ".join(f"{cell:<{width}}" for cell, width in zip(row, widths, strict=True)).rstrip())


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seconds", type=float, default=300.0, help="length of each film (300)")
    parser.add_argument("--seeds", type=int, default=3, help="films of each kind (3)")
    parser.add_argument("--liveliness", type=float, default=1.0, help="0..1 (1)")
    parser.add_argument("--only", default=",".join(FILMS), help=f"some of {', '.join(FILMS)}")
    options = parser.parse_args()
    for kind in options.only.split(","):
        films = [FILMS[kind](seed, options.seconds, options.liveliness) for seed in range(options.seeds)]
        print_measures(kind, {"ours": films}, MEASURES[kind])


if __name__ == "__main__":
    main()
