"""A realization as WebVTT (.vtt): what is said, word by word, and every sync point, as cues."""

from __future__ import annotations

import html
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from realizer.outputs.files import write_text
from realizer.outputs.output import Drawing, Output

if TYPE_CHECKING:
    from realizer.pipeline import Realization

__all__ = ["OUTPUTS", "encode_vtt", "write_vtt"]

LEAST = 0.001  # s; WebVTT wants every cue to end after it starts, and counts milliseconds


@dataclass(frozen=True, slots=True)
class _Cue:
    start: float
    end: float
    kind: str  # "word" or "sync": the class a style sheet can pick it by
    text: str
    id: str = ""


def encode_vtt(realization: Realization) -> str:
    """Cues by start time: words as `<c.word>`, sync points as `<c.sync>`, named and a frame long."""
    cues = sorted([*_words(realization), *_syncs(realization)], key=lambda cue: (cue.start, cue.kind, cue.id))
    blocks = ["WEBVTT"]
    for cue in cues:
        head = f"{_clock(cue.start)} --> {_clock(max(cue.end, cue.start + LEAST))}"
        identifier = [cue.id.replace("-->", "--")] if cue.id else []
        blocks.append(
            "\n".join([*identifier, head, f"<c.{cue.kind}>{html.escape(cue.text, quote=False)}</c>"])
        )
    return "\n\n".join(blocks) + "\n"


def write_vtt(realization: Realization, path: Path, drawing: Drawing) -> None:
    write_text(path, encode_vtt(realization))


def _words(realization: Realization) -> Iterator[_Cue]:
    for start, utterance in realization.speech:
        for word in utterance.words:
            yield _Cue(start + word.start, start + word.end, "word", " ".join(word.text.split()))


def _syncs(realization: Realization) -> Iterator[_Cue]:
    frame = 1 / realization.fps
    for schedule in realization.schedules:
        for behaviour, times in schedule.times.items():
            for point, time in zip(schedule.points[behaviour], times, strict=True):
                at = schedule.start + float(time)
                name = f"{schedule.block}:{behaviour}:{point}"
                yield _Cue(at, at + frame, "sync", name, name)


def _clock(seconds: float) -> str:
    milliseconds = round(max(0.0, seconds) * 1000)
    minutes, milliseconds = divmod(milliseconds, 60_000)
    return f"{minutes // 60:02}:{minutes % 60:02}:{milliseconds // 1000:02}.{milliseconds % 1000:03}"


OUTPUTS = (Output(".vtt", "text/vtt", "words and sync points as WebVTT cues", write_vtt),)
