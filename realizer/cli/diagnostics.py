"""A fault and the text it is in, in; lines for people out: where, the source line, what is marked, help."""

from __future__ import annotations

import unicodedata
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from textwrap import wrap

import click

from bml_schema.source import Source, Spot

__all__ = ["Finding", "Label", "one_line", "render"]

_TAB = 4  # columns, wherever the tab stands: what counts is that the mark is below the right character
_CUT = "..."
_LEAST = 20  # columns of source that are shown however narrow the terminal is


@dataclass(frozen=True, slots=True)
class Label:
    """Words for a place; `primary` where the fault is, else for what it clashes with."""

    spot: Spot
    text: str = ""
    primary: bool = True


@dataclass(frozen=True, slots=True)
class Finding:
    """A fault of a document, or advice.

    Attributes:
        file: as the user named it.
        type: BML warning type, or "ADVICE".
        id: of the block, "block:behaviour", or a constraint's.
        path: of the element, "" where there is none.
        text: all of it in one line.
        head: the same where labels and notes tell the rest.
        labels: the first primary one says the line and column of the whole.
        notes: sentences below the source, such as "help: did you mean ...?".
    """

    file: str
    type: str
    id: str
    path: str
    text: str
    head: str
    labels: tuple[Label, ...] = ()
    notes: tuple[str, ...] = ()

    @property
    def spot(self) -> Spot | None:
        first = next((label for label in self.labels if label.primary), None)
        return first.spot if first else None


def one_line(finding: Finding, text: str | None = None) -> str:
    """`file:line:column: TYPE id: line N, path: text`, whatever blanks the text holds."""
    spot = finding.spot
    at = f":{spot.line}:{spot.column}" if spot else ""
    where = ", ".join(filter(None, (f"line {spot.line}" if spot else "", finding.path)))
    words = " ".join((finding.text if text is None else text).split())
    return f"{finding.file}{at}: {finding.type} {finding.id}: {f'{where}: ' if where else ''}{words}"


def render(finding: Finding, source: Source, *, width: int = 100) -> str:
    """The finding as a good compiler shows it, with ANSI colours; `click.echo` takes them out where they
    do not belong.

    Args:
        source: of the text that it is in.
        width: columns of the terminal.
    """
    head = one_line(finding, finding.head)
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
    """A mark and its words in one line, or in two where they are too long for that."""
    if len(mark) + 1 + len(text) <= room:
        return [f"{mark} {text}".rstrip()]
    start = min(len(mark) - len(mark.lstrip()), max(0, room - len(text)))
    return [mark, " " * start + text]


def _excerpts(
    line: str, labels: Sequence[Label], width: int
) -> Iterator[tuple[str, list[tuple[str, Label]]]]:
    """The line with the marks below it; a line that is too long once for each label, cut around it."""
    cells = [_cell(character) for character in line]
    first, last = _window(cells, labels, width)
    if all(first < label.spot.column and _end(label) <= last for label in labels):
        groups = [labels]
    else:
        groups = [[label] for label in labels]
    for some in groups:
        first, last = _window(cells, some, width)
        before, after = (_CUT if first else ""), (_CUT if last < len(cells) else "")
        row = before + "".join(shown for shown, _ in cells[first:last]) + after
        marks = []
        for label in some:
            start, end = min(label.spot.column - 1, len(cells)), min(_end(label), last)
            blanks = len(before) + sum(columns for _, columns in cells[first:start])
            sign = "^" if label.primary else "-"
            length = max(1, sum(columns for _, columns in cells[start:end]))
            marks.append((" " * blanks + sign * length, label))
        yield row, marks


def _end(label: Label) -> int:
    return label.spot.column - 1 + label.spot.length


def _window(cells: Sequence[tuple[str, int]], labels: Sequence[Label], width: int) -> tuple[int, int]:
    """First and last + 1 of the characters that fit, with the labels in their middle."""
    if sum(columns for _, columns in cells) <= width:
        return 0, len(cells)
    room = width - 2 * len(_CUT)
    first = last = min(min(label.spot.column for label in labels) - 1, len(cells))
    most = max(map(_end, labels))
    columns = 0
    while last < min(most, len(cells)) and columns + cells[last][1] <= room:
        columns += cells[last][1]
        last += 1
    while True:
        grown = False
        for back in (True, False):
            at = first - 1 if back else last
            if 0 <= at < len(cells) and columns + cells[at][1] <= room:
                columns += cells[at][1]
                first, last = (at, last) if back else (first, at + 1)
                grown = True
        if not grown:
            return first, last


def _cell(character: str) -> tuple[str, int]:
    """A character as a terminal can show it, and how many columns it takes."""
    if character == "\t":
        return " " * _TAB, _TAB
    category = unicodedata.category(character)
    if category in ("Mn", "Me"):
        return character, 0
    if category in ("Cf", "Cc", "Cs", "Cn", "Zl", "Zp"):
        # A byte order mark or a change of direction would move what follows.
        return ("", 0) if character == "\ufeff" else ("\N{REPLACEMENT CHARACTER}", 1)
    return character, 2 if unicodedata.east_asian_width(character) in "WF" else 1
