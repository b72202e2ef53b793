"""The output .rhubarb.json: mouth cues as Rhubarb Lip Sync writes them, for 2D characters."""

from typing import Any

from realizer.outputs import speech_spans
from realizer.outputs.json_text import json_line
from realizer.outputs.output import text_output
from realizer.realization import Realization

REST, TONGUE = "X", "H"
# Rhubarb's mouth shape of each viseme of MPEG-4, whose viseme 8 is both n and l.
SHAPES = (REST, *"AGBBBBBBEDCBEF")


def encode_rhubarb(realization: Realization) -> str:
    """Return a line of JSON with the cues of the first character, which cover its whole time."""
    cues: list[dict[str, Any]] = []
    end = 0.0

    def cue(until: float, shape: str) -> None:
        nonlocal end
        start, end = end, round(min(until, realization.duration), 2)
        if end <= start:
            end = start
        elif cues and cues[-1]["value"] == shape:
            cues[-1]["end"] = end
        else:
            cues.append({"start": start, "end": end, "value": shape})

    spans = [
        span
        for speaking in realization.speeches
        if speaking.character == 0
        for span in speech_spans.visemes(speaking, _shape)
    ]
    for span in sorted(spans, key=lambda span: span.start):
        cue(span.start, REST)
        cue(span.end, span.text)
    cue(realization.duration, REST)
    metadata = {"soundFile": "", "duration": round(realization.duration, 2)}
    return json_line({"metadata": metadata, "mouthCues": cues})


def _shape(viseme: int, ipa: str) -> str:
    return TONGUE if "l" in ipa else SHAPES[viseme]


RHUBARB = text_output(
    ".rhubarb.json",
    "application/json",
    "mouth shapes A to H and X as Rhubarb Lip Sync writes them",
    encode_rhubarb,
)
