"""The outputs .vtt (words, phonemes and sync points as WebVTT cues) and .srt (captions)."""

import html

from realizer.outputs import speech_spans
from realizer.outputs.captions import captions
from realizer.outputs.output import text_output
from realizer.realization import Realization

LEAST = 0.001  # s; WebVTT requires cues to end after their start, and counts milliseconds
KINDS = ("word", "phoneme", "sync")  # classes for style sheets, in the order of cues that start together


def encode_vtt(realization: Realization) -> str:
    """Return cues by start time: words as `<c.word>`, IPA as `<c.phoneme>`, sync points as `<c.sync>`.

    The cue of a sync point lasts a frame, and its identifier is its name.
    """
    cues = [
        (span.start, kind, "", span.end, span.text)
        for kind, spans_of in enumerate((speech_spans.words, speech_spans.phonemes))
        for speaking in realization.speeches
        for span in spans_of(speaking)
    ]
    points = speech_spans.points(realization)
    cues += [(time, 2, name, time + 1 / realization.fps, name) for time, name in points]
    blocks = ["WEBVTT\n"]
    for start, kind, id, end, text in sorted(cues, key=lambda cue: cue[:3]):
        identifier = id.replace("-->", "--") + "\n" if id else ""
        clock = f"{timestamp(start)} --> {timestamp(max(end, start + LEAST))}"
        blocks.append(f"{identifier}{clock}\n<c.{KINDS[kind]}>{html.escape(text, quote=False)}</c>\n")
    return "\n".join(blocks)


def timestamp(seconds: float) -> str:
    """Return HH:MM:SS.mmm."""
    milliseconds = round(max(0.0, seconds) * 1000)
    minutes, milliseconds = divmod(milliseconds, 60_000)
    return f"{minutes // 60:02}:{minutes % 60:02}:{milliseconds // 1000:02}.{milliseconds % 1000:03}"


VTT = text_output(
    ".vtt", "text/vtt", "words, phonemes and sync points as WebVTT cues", encode_vtt, all_characters=True
)


def encode_srt(realization: Realization) -> str:
    """Return numbered captions; simultaneous speech is in separate lines of one caption."""
    last = realization.duration
    return "\n".join(
        f"{number}\n{_clock(shown.start)} --> {_clock(min(shown.end, last))}\n{shown.text}\n"
        for number, shown in enumerate(captions(realization), 1)
    )


def _clock(seconds: float) -> str:
    return timestamp(seconds).replace(".", ",")


SRT = text_output(
    ".srt", "application/x-subrip", "captions as SubRip subtitles", encode_srt, all_characters=True
)
