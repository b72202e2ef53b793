"""The output .textgrid: words, phonemes and sync points for Praat and ELAN."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import groupby

from realizer.outputs import speech_spans
from realizer.outputs.output import text_output
from realizer.outputs.speech_spans import Span
from realizer.realization import Realization

DIGITS = 6  # decimals: microseconds


def encode_textgrid(realization: Realization) -> str:
    """Return Praat's long text format with interval tiers `words` and `phonemes` and a point tier `syncs`.

    Further characters have tiers named after them. Points at the same time are one, with names separated by
    blanks, because a tier cannot have two points at the same time.
    """
    spans: list[tuple[str, list[Span]]] = []
    for index, name in enumerate(realization.characters):
        own = [speaking for speaking in realization.speeches if speaking.character == index]
        own.sort(key=lambda speaking: speaking.start)
        prefix = f"{name or index} " if index else ""
        spans += [
            (f"{prefix}words", [word for speaking in own for word in speech_spans.words(speaking)]),
            (f"{prefix}phonemes", [sound for speaking in own for sound in speech_spans.phonemes(speaking)]),
        ]
    points = sorted(speech_spans.points(realization))
    ends = [*(span.end for _, tier in spans for span in tier), *(time for time, _ in points)]
    end = max([realization.duration, 1 / realization.fps, *ends])
    tiers = [_intervals(name, end, tier) for name, tier in spans]
    return _file([*tiers, _points("syncs", end, points)], end)


def intervals_text(tiers: Mapping[str, Iterable[Span]], end: float) -> str:
    """Return a TextGrid with tiers of intervals, each in order and without overlaps.

    Args:
        end: seconds of the whole.
    """
    return _file([_intervals(name, end, spans) for name, spans in tiers.items()], end)


def _file(tiers: Sequence[Iterable[str]], end: float) -> str:
    lines = [
        'File type = "ooTextFile"', 'Object class = "TextGrid"', "",
        "xmin = 0", f"xmax = {_number(end)}", "tiers? <exists>", f"size = {len(tiers)}", "item []:",
    ]  # fmt: skip
    for k, tier in enumerate(tiers, 1):
        lines += [f"    item [{k}]:", *(f"        {line}" for line in tier)]
    return "\n".join(lines) + "\n"


def _intervals(name: str, end: float, spans: Iterable[Span]) -> list[str]:
    """Return an interval tier, in which silence is an interval without text."""
    rows = [
        (f"xmin = {_number(span.start)}", f"xmax = {_number(span.end)}", f"text = {_quoted(span.text)}")
        for span in _filled(end, spans)
    ]
    return _tier("IntervalTier", name, end, "intervals", rows)


def _filled(end: float, spans: Iterable[Span]) -> Iterator[Span]:
    now = 0.0
    for span in spans:
        start, last = round(max(span.start, now), DIGITS), round(span.end, DIGITS)
        if last <= start:
            continue
        if start > now:
            yield Span(now, start, "")
        yield Span(start, last, span.text)
        now = last
    if round(end, DIGITS) > now:
        yield Span(now, end, "")


def _points(name: str, end: float, points: Iterable[tuple[float, str]]) -> list[str]:
    rows = [
        (f"number = {time}", f"mark = {_quoted(' '.join(name for _, name in names))}")
        for time, names in groupby(points, lambda point: _number(max(point[0], 0.0)))
    ]
    return _tier("TextTier", name, end, "points", rows)


def _tier(kind: str, name: str, end: float, items: str, rows: Sequence[Iterable[str]]) -> list[str]:
    lines = [f'class = "{kind}"', f"name = {_quoted(name)}", "xmin = 0", f"xmax = {_number(end)}"]
    lines.append(f"{items}: size = {len(rows)}")
    for k, row in enumerate(rows, 1):
        lines += [f"{items} [{k}]:", *(f"    {line}" for line in row)]
    return lines


def _number(seconds: float) -> str:
    return f"{round(seconds, DIGITS):.{DIGITS}f}".rstrip("0").rstrip(".")


def _quoted(text: str) -> str:
    return '"' + text.replace('"', '""') + '"'


TEXTGRID = text_output(
    ".textgrid",
    "text/x-textgrid",
    "words, phonemes and sync points for Praat",
    encode_textgrid,
    all_characters=True,
)
