"""The output .srt: captions as SubRip subtitles."""

from realizer.outputs.captions import captions
from realizer.outputs.output import Output
from realizer.outputs.vtt import timestamp
from realizer.realization import Realization


def encode_srt(realization: Realization) -> str:
    """Return numbered captions; simultaneous speech is in separate lines of one caption."""
    return "\n".join(
        f"{number}\n{_clock(caption.start)} --> {_clock(min(caption.end, realization.duration))}\n{caption.text}\n"
        for number, caption in enumerate(captions(realization), 1)
    )


def _clock(seconds: float) -> str:
    return timestamp(seconds).replace(".", ",")


SRT = Output(
    ".srt",
    "application/x-subrip",
    "captions as SubRip subtitles",
    lambda realization, _: encode_srt(realization).encode(),
    all_characters=True,
    reader="av",
)
