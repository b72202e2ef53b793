"""The output .vtt: words, phonemes and sync points as WebVTT cues."""

from __future__ import annotations

import html
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from realizer.outputs import speech_spans
from realizer.outputs.output import Output

if TYPE_CHECKING:
    from realizer.realization import Realization

LEAST = 0.001  # s; WebVTT requires cues to end after their start, and counts milliseconds
KINDS = ("word", "phoneme", "sync")  # the order of cues that start together


@dataclass(frozen=True, slots=True)
class _Cue:
    start: float
    end: float
    kind: str  # the class for style sheets and programs
    text: str
    id: str = ""


def encode_vtt(realization: Realization) -> str:
    """Return cues by start time: words as `<c.word>`, IPA as `<c.phoneme>`, sync points as `<c.sync>`.

    The cue of a sync point lasts a frame, and its identifier is its name.
    """
    blocks = ["WEBVTT\n"]
    for cue in sorted(_cues(realization), key=lambda cue: (cue.start, KINDS.index(cue.kind), cue.id)):
        identifier = cue.id.replace("-->", "--") + "\n" if cue.id else ""
        clock = f"{timestamp(cue.start)} --> {timestamp(max(cue.end, cue.start + LEAST))}"
        text = html.escape(cue.text, quote=False)
        blocks.append(f"{identifier}{clock}\n<c.{cue.kind}>{text}</c>\n")
    return "\n".join(blocks)


def _cues(realization: Realization) -> Iterator[_Cue]:
    for kind, spans_of in (("word", speech_spans.words), ("phoneme", speech_spans.phonemes)):
        for speaking in realization.speeches:
            for span in spans_of(speaking):
                yield _Cue(span.start, span.end, kind, span.text)
    for time, name in speech_spans.points(realization):
        yield _Cue(time, time + 1 / realization.fps, "sync", name, name)


def timestamp(seconds: float) -> str:
    """Return HH:MM:SS.mmm."""
    milliseconds = round(max(0.0, seconds) * 1000)
    minutes, milliseconds = divmod(milliseconds, 60_000)
    return f"{minutes // 60:02}:{minutes % 60:02}:{milliseconds // 1000:02}.{milliseconds % 1000:03}"


VTT = Output(
    ".vtt",
    "text/vtt",
    "words, phonemes and sync points as WebVTT cues",
    lambda realization, _: encode_vtt(realization).encode(),
    all_characters=True,
    reader="webvtt",
)
