"""The output .vtt: words, phonemes and sync points as WebVTT cues."""

from __future__ import annotations

import html
from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from realizer.outputs import speech_spans
from realizer.outputs.output import Output, RenderSettings

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
    cues = sorted(_cues(realization), key=lambda cue: (cue.start, KINDS.index(cue.kind), cue.id))
    blocks = ["WEBVTT"]
    for cue in cues:
        head = f"{timestamp(cue.start)} --> {timestamp(max(cue.end, cue.start + LEAST))}"
        identifier = [cue.id.replace("-->", "--")] if cue.id else []
        blocks.append(
            "\n".join([*identifier, head, f"<c.{cue.kind}>{html.escape(cue.text, quote=False)}</c>"])
        )
    return "\n\n".join(blocks) + "\n"


def _encode(realization: Realization, drawing: RenderSettings) -> bytes:
    return encode_vtt(realization).encode()


def _cues(realization: Realization) -> Iterator[_Cue]:
    for speaking in realization.speeches:
        for kind, spans in (
            ("word", speech_spans.words(speaking)),
            ("phoneme", speech_spans.phonemes(speaking)),
        ):
            for span in spans:
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
    _encode,
    all_characters=True,
    reader="webvtt",
)
