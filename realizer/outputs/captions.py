"""Captions: subtitles of the speech in a film."""

from __future__ import annotations

import html
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from difflib import SequenceMatcher
from fractions import Fraction
from itertools import pairwise, zip_longest
from typing import TYPE_CHECKING, Any

from realizer.outputs import speech_spans
from realizer.outputs.speech_spans import Span
from realizer.speech.words import words_in

if TYPE_CHECKING:
    from realizer.playback.scheduled_speech import ScheduledSpeech
    from realizer.realization import Realization

# As usual for subtitles: about 40 letters a line, and a new line at a pause of the voice.
MOST, ENOUGH = 42, 20  # letters; a line that has enough, or a sentence, ends at a short pause
REST, LONG_REST = 0.12, 0.6  # s
SENTENCE = re.compile(r"[.!?…。！？][^\w\s]*$")
LINGER = 0.4  # s that a line stays after its last word
CLOCK = Fraction(1, 1000)
# The encoder of MP4's subtitles takes their style from this.
STYLE = (
    b"[Script Info]\nScriptType: v4.00+\nPlayResX: 384\nPlayResY: 288\n\n[V4+ Styles]\n"
    b"Format: Name, Fontname, Fontsize, PrimaryColour, SecondaryColour, OutlineColour, BackColour, Bold, "
    b"Italic, Underline, StrikeOut, ScaleX, ScaleY, Spacing, Angle, BorderStyle, Outline, Shadow, Alignment, "
    b"MarginL, MarginR, MarginV, Encoding\n"
    b"Style: Default,Arial,16,&Hffffff,&Hffffff,&H0,&H0,0,0,0,0,100,100,0,0,1,1,0,2,10,10,10,1\n\n"
    b"[Events]\nFormat: Layer, Start, End, Style, Name, MarginL, MarginR, MarginV, Effect, Text\n"
)


def captions(realization: Realization) -> tuple[Span, ...]:
    """Return spans in order without overlap; simultaneous speech is shown in separate lines."""
    lines = [line for speaking in realization.speeches for line in _lines(speaking)]
    bounds = sorted({time for line in lines for time in (line.start, line.end)})
    found = []
    for start, end in pairwise(bounds):
        shown = [line.text for line in lines if line.start < end and line.end > start]
        if shown and end - start >= speech_spans.MIN_LENGTH:
            found.append(Span(start, end, "\n".join(shown)))
    return tuple(found)


def _lines(speaking: ScheduledSpeech) -> Iterator[Span]:
    """Yield the lines of an utterance; each stays a little longer, but not into the next."""
    lines: list[Span] = []
    for word in _written(speaking):
        if lines:
            line = lines[-1]
            text, shown = f"{line.text}{word.text}".rstrip(), line.text.rstrip()
            ends = len(shown) >= ENOUGH or SENTENCE.search(shown)
            if len(text) <= MOST and word.start - line.end < (REST if ends else LONG_REST):
                lines[-1] = Span(line.start, word.end, line.text + word.text)
                continue
        lines.append(word)
    for line, after in zip_longest(lines, lines[1:]):
        end = line.end + LINGER
        end = end if after is None else min(end, max(after.start, line.end))
        yield Span(line.start, end, line.text.rstrip())


def _written(speaking: ScheduledSpeech) -> Iterator[Span]:
    """Yield the words with the punctuation and the blank between them and the next.

    A word that is not in the text of the document, such as one of an alias, has only a blank.
    """
    words = list(speech_spans.words(speaking))
    text = " ".join(str(speaking.text or "").split())
    places = list(words_in(text))
    firsts = [0]  # where each word begins, with signs before it
    for (word, place), (_, after) in pairwise(places):
        signs = re.search(r"(?<=\s)\S*$", text[place + len(word) : after])
        firsts.append(after - len(signs[0]) if signs else after)
    parts = [text[first:end] for first, end in pairwise([*firsts, len(text)])]
    same = SequenceMatcher(None, [w.text for w in words], [word for word, _ in places], autojunk=False)
    found = {
        block.a + k: parts[block.b + k] for block in same.get_matching_blocks() for k in range(block.size)
    }
    for number, span in enumerate(words):
        yield replace(span, text=found.get(number, f"{span.text} "))


class Track:
    """A subtitle stream of a film, which players show by default.

    Args:
        codec: FFmpeg's name: mov_text for MP4, webvtt for WebM.
        lines: in order.
        end: of the film, in seconds; later lines are cut.
    """

    def __init__(self, av: Any, film: Any, codec: str, lines: Sequence[Span], end: float) -> None:
        self._av, self._film, self._codec, self._end = av, film, codec, end
        self._left = list(reversed(lines))
        self._stream = film.add_stream(codec)
        self._stream.codec_context.subtitle_header = STYLE
        self._stream.codec_context.time_base = self._stream.time_base = CLOCK

    def write(self, until: float) -> None:
        """Write the lines that start before a time, in seconds, and were not written before."""
        while self._left and self._left[-1].start < until:
            line = self._left.pop()
            packet = self._av.Packet(_coded(self._codec, line.text))
            packet.stream, packet.time_base = self._stream, CLOCK
            packet.pts = packet.dts = round(line.start / CLOCK)
            packet.duration = max(1, round(min(line.end, self._end) / CLOCK) - packet.pts)
            self._film.mux(packet)


def _coded(codec: str, text: str) -> bytes:
    if codec == "mov_text":
        # 3GPP TS 26.245, 5.17: the length in bytes, then the text; no boxes after it.
        raw = text.encode()
        return len(raw).to_bytes(2, "big") + raw
    return html.escape(text, quote=False).encode()
