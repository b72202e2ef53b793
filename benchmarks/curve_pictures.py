"""Draws the curves in docs/ as SVG: `python -m benchmarks.curve_pictures`; the voice is espeak-ng."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np

import realizer
from realizer.animation.axis import AU_NAMES
from realizer.animation.cooccurrence import bounds
from realizer.animation.lips.dominance import dominances, track_of
from realizer.core.array_types import Float64
from realizer.speech.melody import RATE, melody
from realizer.tables.cooccurrence import rules

DOCS = Path(__file__).parents[1] / "docs"
COLOURS = ("#3867d6", "#e1701a", "#2d9d62", "#a34fc9", "#b8860b", "#d63864")
WIDTH, HEIGHT, LEFT, GAP = 760, 110, 130, 34  # pixels of a picture, a panel, its margin, and between panels
STYLE = """<style>
  polyline { fill: none; stroke-width: 1.8 } .panel { fill: #f4f5f8 } .title { font-weight: bold }
  .number { text-anchor: end; fill: #555 } .word { text-anchor: middle; fill: #555 } .edge { stroke: #ccc }
</style>
"""
SENTENCE = "Are you sure? I can hardly believe that you came all this way."
WORDS = "a warm baby"


@dataclass(frozen=True)
class Panel:
    """One diagram: `lines` are (name, x, y), `spans` are (first, last, text) along the x axis."""

    title: str
    lines: Sequence[tuple[str, Float64, Float64]]
    span: tuple[float, float]
    unit: str = ""
    spans: Sequence[tuple[float, float, str]] = ()


def drawing(title: str, panels: Sequence[Panel], axis: str) -> str:
    """Panels above each other, which share the x axis `axis`."""
    first = min(float(x[0]) for panel in panels for _, x, _ in panel.lines)
    last = max(float(x[-1]) for panel in panels for _, x, _ in panel.lines)

    def across(x: float) -> float:
        return LEFT + (x - first) / (last - first) * (WIDTH - LEFT - 20)

    parts = []
    for row, panel in enumerate(panels):
        top = 20 + row * (HEIGHT + GAP)
        low, high = panel.span
        parts.append(
            f'<rect x="{LEFT}" y="{top}" width="{WIDTH - LEFT - 20}" height="{HEIGHT}" class="panel"/>'
        )
        parts.append(f'<text x="12" y="{top + 14}" class="title">{escape(panel.title)}</text>')
        for value, y in ((high, top + 10), (low, top + HEIGHT)):
            parts.append(f'<text x="{LEFT - 6}" y="{y}" class="number">{value:g}{escape(panel.unit)}</text>')
        for begin, end, text in panel.spans:
            x = across(begin)
            parts.append(f'<line x1="{x:.1f}" y1="{top}" x2="{x:.1f}" y2="{top + HEIGHT}" class="edge"/>')
            parts.append(
                f'<text x="{(x + across(end)) / 2:.1f}" y="{top + 13}" class="word">{escape(text)}</text>'
            )
        for k, (name, x, y) in enumerate(panel.lines):
            scaled = top + HEIGHT * (high - np.clip(y, low, high)) / (high - low)
            points = " ".join(
                f"{across(a):.1f},{b:.1f}" for a, b in zip(x.tolist(), scaled.tolist(), strict=True)
            )
            colour = COLOURS[k % len(COLOURS)]
            parts.append(f'<polyline points="{points}" stroke="{colour}"/>')
            parts.append(f'<text x="12" y="{top + 32 + 16 * k}" fill="{colour}">{escape(name)}</text>')
    height = 20 + len(panels) * (HEIGHT + GAP)
    for x in np.linspace(first, last, 6):
        parts.append(f'<text x="{across(x):.1f}" y="{height - GAP + 16}" class="word">{x:.1f}</text>')
    parts.append(f'<text x="{WIDTH - 20}" y="{height - 2}" class="number">{escape(axis)}</text>')
    size = f'viewBox="0 0 {WIDTH} {height}" font-family="sans-serif" font-size="12"'
    head = f'<svg xmlns="http://www.w3.org/2000/svg" {size}>\n<title>{escape(title)}</title>\n{STYLE}'
    return f'{head}<rect width="{WIDTH}" height="{height}" fill="#fff"/>\n{chr(10).join(parts)}\n</svg>\n'


def cooccurrence() -> str:
    """What is left of a requested unit at 0.8 as the other one grows from 0 to 1."""
    other = np.linspace(0, 1, 101)
    panels = []
    for title, (kept, rising) in {
        "domination": ("5", "63"),
        "a strong one": ("12", "15"),
        "exclusion": ("28", "18"),
        "opposition": ("51", "52"),
    }.items():
        names = AU_NAMES()
        asked = np.zeros((len(names), len(other)), np.float32)
        of = {
            number: [k for k, name in enumerate(names) if name.rstrip("LR") == number]
            for number in (kept, rising)
        }
        asked[of[kept]], asked[of[rising]] = 0.8, other
        moving = bounds(rules()).moving(asked)
        lines = [
            (f"AU{kept}, asked 0.8", other, moving[of[kept][0]]),
            (f"AU{rising}", other, moving[of[rising][0]]),
        ]
        panels.append(Panel(title, lines, (0, 1)))
    return drawing("What co-occurrence rules leave of two action units", panels, "asked of the second unit")


def prosody() -> str:
    """Loudness and pitch of a sentence, and what head and brows do."""
    played = realizer.realize(SENTENCE, voice="espeak", seed=3, fps=50, idle=True)
    speech = played.speeches[0]
    heard = melody(speech.utterance)
    spoken = int(speech.utterance.words[-1].end * RATE)
    at = speech.start + np.arange(spoken) / RATE
    times = np.arange(played.frames) / played.fps
    aus = dict(zip(AU_NAMES(), played.aus.aus.T, strict=True))
    size = 25.0 if "53" in aus else 1.0
    pitch = size * (aus["53"] - aus["54"])
    turn = size * (aus["51"] - aus["52"])
    words = [(speech.start + w.start, speech.start + w.end, w.text) for w in speech.utterance.words]
    return drawing(
        SENTENCE,
        [
            Panel(
                "the voice",
                [("loudness", at, heard.loudness[:spoken]), ("pitch / 12 st", at, heard.pitch[:spoken] / 12)],
                (-0.6, 1),
                "",
                words,
            ),
            Panel("the head", [("up", times, pitch), ("to the left", times, turn)], (-4, 4), "°"),
            Panel("brows", [("AU1", times, aus["1L"]), ("AU2", times, aus["2L"])], (0, 0.4)),
        ],
        "seconds",
    )


def lips() -> str:
    """Dominance of the sounds of a phrase for the jaw, and the opening of the jaw."""
    played = realizer.realize(WORDS, voice="espeak", idle=False, prosody=False, fps=100)
    speech = played.speeches[0]
    phonemes = speech.utterance.phonemes
    track = track_of(phonemes)
    assert track is not None
    times = np.linspace(0, float(track.end[-1]), 240)
    near, parts, _ = next(iter(dominances(track, times)))
    lines = []
    for k in range(len(track.begin)):
        own = np.where(near == k, parts, 0).max(axis=0)
        lines.append(("", speech.start + times, own))
    sounds = [(speech.start + p.start, speech.start + p.end, p.ipa) for p in phonemes]
    frames = np.arange(played.frames) / played.fps
    shown = frames <= speech.start + times[-1]
    faps = played.faps.values[shown]
    opened = [
        ("jaw (FAP 3)", frames[shown], faps[:, 2]),
        ("lips (FAP 5 + 4)", frames[shown], -(faps[:, 3] + faps[:, 4])),
    ]
    return drawing(
        f"Dominance of the sounds of {WORDS!r} for the jaw",
        [Panel("dominance", lines, (0, 1), "", sounds), Panel("opening", opened, (-150, 600), "", sounds)],
        "seconds",
    )


def main() -> None:
    """Draw all of them."""
    for draw in (cooccurrence, prosody, lips):
        (DOCS / f"{draw.__name__}.svg").write_text(draw(), "utf-8")


if __name__ == "__main__":
    main()
