"""Text of findings for people: place, source line, marks and help."""

import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate, groupby
from textwrap import wrap

import click

from bml_schema.source import Source
from realizer.checking.finding import Finding, Label

_TAB = 4  # columns of every tab, so that marks are below the right character
_CUT = "..."
_LEAST = 20  # columns of source that are always shown


def render(finding: Finding, source: Source, *, width: int = 100) -> str:
    """Return the finding as compilers show errors, with ANSI colours.

    Args:
        source: the text that the finding is about.
        width: columns of the terminal.
    """
    head = finding.one_line(finding.head)
    colour = "yellow" if finding.type == "ADVICE" else "red"
    place, kind, rest = head.partition(f" {finding.type} ")
    lines = [click.style(place, bold=True) + click.style(kind, fg=colour, bold=True) + rest]
    labels = sorted(finding.labels, key=lambda label: (label.spot.line, not label.primary))
    gutter = len(str(labels[-1].spot.line)) if labels else 1
    room = max(_LEAST, width - gutter - 3)
    bar = click.style("|", fg="blue")
    last = None
    for number, group in groupby(labels, key=lambda label: label.spot.line):
        skipped = last is not None and number > last + 1
        lines.append(click.style(_CUT, fg="blue") if skipped else f"{'':{gutter}} {bar}")
        shown = click.style(f"{number:>{gutter}} |", fg="blue")
        for row, marks in _excerpts(source.line(number), list(group), room):
            lines.append(f"{shown} {row}".rstrip())
            for mark, label in marks:
                colour = "red" if finding.type != "ADVICE" else "yellow"
                for words in _beside(mark, label.text, room):
                    painted = click.style(words, fg=colour if label.primary else "blue")
                    lines.append(f"{'':{gutter}} {bar} {painted}")
        last = number
    for note in finding.notes:
        first, *more = wrap(note, room) or [""]
        kind, colon, rest = first.partition(": ")
        lines.append(
            f"{'':{gutter}} {click.style('=', fg='blue')} {click.style(kind, bold=True)}{colon}{rest}"
        )
        lines += (f"{'':{gutter + 9}}{line}" for line in more)
    return "\n".join(lines)


def _beside(mark: str, text: str, room: int) -> list[str]:
    """Return a mark and its words on one line, or on two if they are too long."""
    if len(mark) + 1 + len(text) <= room:
        return [f"{mark} {text}".rstrip()]
    start = min(len(mark) - len(mark.lstrip()), max(0, room - len(text)))
    return [mark, " " * start + text]


def _excerpts(
    line: str, labels: Sequence[Label], width: int
) -> Iterator[tuple[str, list[tuple[str, Label]]]]:
    """Yield the line with the marks below it; a long line is cut around each label instead."""
    first, last = min(label.spot.column for label in labels) - 1, max(map(_end, labels))
    excerpt = _cut(line, first, last, width)
    fits = last - first <= width and excerpt.first <= first and last <= excerpt.last
    for group in [labels] if fits else [[label] for label in labels]:
        if not fits:
            excerpt = _cut(line, group[0].spot.column - 1, _end(group[0]), width)
        marks = []
        for label in group:
            start, end = (excerpt.column(at) for at in (label.spot.column - 1, _end(label)))
            sign = "^" if label.primary else "-"
            marks.append((" " * start + sign * max(1, end - start), label))
        yield excerpt.text, marks


def _end(label: Label) -> int:
    return label.spot.column - 1 + label.spot.length


@dataclass(frozen=True, slots=True)
class _Excerpt:
    """Characters first..last of a line as a terminal shows them, and the column of each."""

    text: str
    first: int
    last: int
    columns: Sequence[int]

    def column(self, at: int) -> int:
        """Return the column of a character; a character that was cut off is at the nearer end."""
        return self.columns[min(max(at, self.first), self.last) - self.first]


def _cut(line: str, first: int, last: int, width: int) -> _Excerpt:
    """Return as much around line[first:last] as fits into `width` columns."""
    # A line may be a whole document; characters further away cannot fit.
    begin, end = max(0, first - 2 * width), min(len(line), last + 2 * width)
    cells = [_cell(character) for character in line[begin:end]]
    whole = begin == 0 and end == len(line) and sum(columns for _, columns in cells) <= width
    low, high = (0, len(cells)) if whole else _window(cells, first - begin, last - begin, width)
    before, after = (_CUT if begin + low > 0 else ""), (_CUT if begin + high < len(line) else "")
    columns = accumulate((columns for _, columns in cells[low:high]), initial=len(before))
    text = before + "".join(shown for shown, _ in cells[low:high]) + after
    return _Excerpt(text, begin + low, begin + high, tuple(columns))


def _window(cells: Sequence[tuple[str, int]], first: int, last: int, width: int) -> tuple[int, int]:
    """Return the range of characters that fit, with first..last in the middle."""
    room = width - 2 * len(_CUT)
    low = high = min(first, len(cells))
    columns = 0
    while high < min(last, len(cells)) and columns + cells[high][1] <= room:
        columns += cells[high][1]
        high += 1
    while True:
        grown = False
        for at in (low - 1, high):
            if 0 <= at < len(cells) and columns + cells[at][1] <= room:
                columns += cells[at][1]
                low, high = min(low, at), max(high, at + 1)
                grown = True
        if not grown:
            return low, high


def _cell(character: str) -> tuple[str, int]:
    """Return a character as a terminal can show it, and its width in columns."""
    if character == "\t":
        return " " * _TAB, _TAB
    category = unicodedata.category(character)
    if category in ("Mn", "Me"):
        return character, 0
    if category in ("Cf", "Cc", "Cs", "Cn", "Zl", "Zp"):
        # A byte order mark or a change of direction would move the rest of the line.
        return ("", 0) if character == "\ufeff" else ("\N{REPLACEMENT CHARACTER}", 1)
    return character, 2 if unicodedata.east_asian_width(character) in "WF" else 1
