"""The output .srt: captions as SubRip subtitles."""

from realizer.outputs.captions import captions
from realizer.outputs.output import Output
from realizer.outputs.vtt import timestamp
from realizer.realization import Realization


def encode_srt(realization: Realization) -> str:
    """Return numbered captions; simultaneous speech is in separate lines of one caption."""
    last = realization.duration
    return "\n".join(
        f"{number}\n{_clock(shown.start)} --> {_clock(min(shown.end, last))}\n{shown.text}\n"
        for number, shown in enumerate(captions(realization), 1)
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
