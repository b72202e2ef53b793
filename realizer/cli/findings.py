"""A warning about a document in, the finding that explains it out: what to mark, and what may help."""

from __future__ import annotations

import difflib
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any

from bml_schema import Block
from bml_schema.shape import Attribute, local, shape_of
from bml_schema.source import Element, Source, Spot
from realizer.cli.diagnostics import Finding, Label
from realizer.scheduling.timing import Warning

__all__ = ["finding_of", "near"]

_PLACED = re.compile(r"line (\d+)(?:, (/[^\s:]+))?: (.*)", re.DOTALL)
_LOST = re.compile(r"(.*); with it went (.*)", re.DOTALL)
_PIECE = re.compile(r"; (?=[A-Za-z][\w.:-]*: |\{[^}]*\}[\w.-]+: )")
_ATTRIBUTE = re.compile(r"((?:\{[^}]*\})?[A-Za-z][\w.:-]*): (.*)", re.DOTALL)
_ATTRIBUTES = re.compile(r"(\w+(?:, \w+)+): (.*)", re.DOTALL)
_MEANT = re.compile(r"[,;]? ?did you mean (.*)\?\s*$", re.DOTALL)
_LONG_LIST = re.compile(r"wanted one of ((?:[^,;]+, ){5,}[^,;]+); got ")
_NO_POINT = re.compile(r'no sync point "?([^"]+?)"? on "?([^"]+?)"?$')
_NO_BEHAVIOUR = re.compile(r'no behaviour "?([^"]+?)"? in this block')
_TAKEN = re.compile(r"which line (\d+) has")
# The scheduler's words for what clashes; see realizer/scheduling/explain.py.
_CLAUSE = re.compile(
    r"(\S+) (?:is )?(=|not before|not after) ([^,()]+?) \((?:(constraint)(?: ([^,)]+))?, )?line (\d+)\)"
)
_UNPLACED = re.compile(r"\S+ takes (?:at least|exactly) [\d.e+-]+ s from (?:its start|\S+) to [^\s,;]+")
_CANNOT = re.compile(r".+? cannot be (?:placed|kept)")
_ASTRAY = re.compile(
    r"(?:required: )?(\S.*?) was dropped(?: \((?:(constraint)(?: (\S+))?, )?line (\d+)\))?: (.+)"
)
_REFERENCE = re.compile(r"([^:\s]+(?: [^:\s]+)*:\S+(?: [+-] [\d.]+)?)(?=:? )")
_HELD = re.compile(r"but (\S+) has it from")
_BECAUSE = re.compile(r"; (\S+ was dropped because .+)$|; (a constraint that .+)$|(all of this is required)$")
_UNKNOWN_PREFIX = re.compile(r"Namespace prefix (\S+)(?: for \S+)? on (\S+) is not defined")
_MOST_LISTED = 12


def finding_of(file: str, source: Source, warning: Warning, vocabulary: Mapping[str, type[Any]]) -> Finding:
    """What a warning says, with its places.

    Args:
        file: as the user named it.
        source: the text.
        warning: its text begins with "line N, path: " where the place is known.
        vocabulary: Clark tag -> node class, for what might have been meant.
    """
    placed = _PLACED.fullmatch(warning.text)
    line, path, text = (int(placed[1]), placed[2] or "", placed[3]) if placed else (None, "", warning.text)
    words = _Words(source, warning.id, line, path, vocabulary)
    words.explain(text)
    return Finding(
        file=file,
        type=warning.type,
        id=warning.id,
        path=path or words.path,
        text=text,
        head=words.head or text,
        labels=tuple(words.labels),
        notes=tuple(dict.fromkeys(words.notes)),
    )


def near(word: str, choices: Iterable[str], cutoff: float = 0.6) -> str | None:
    """The choice that a word was probably meant to be, whatever its case; None if there is none."""
    by_case = {choice.lower(): choice for choice in choices}
    found = difflib.get_close_matches(word.lower(), by_case, n=1, cutoff=cutoff)
    return by_case[found[0]] if found else None


@dataclass
class _Words:
    """What becomes of the text of one warning."""

    source: Source
    id: str
    line: int | None
    path: str
    vocabulary: Mapping[str, type[Any]]

    def __post_init__(self) -> None:
        self.block = self.id.partition(":")[0]
        self.labels: list[Label] = []
        self.notes: list[str] = []
        self.head = ""
        self.element = self.source.find(self.path, line=self.line, block=self.block) if self.path else None
        if self.element is None and ":" in self.id:
            self.element = self.source.named(self.id.partition(":")[2], line=self.line, block=self.block)

    def explain(self, text: str) -> None:
        lost = _LOST.fullmatch(text)
        if lost:
            text = lost[1]
        if _CLAUSE.search(text):
            self.clash(text)
        elif astray := _ASTRAY.fullmatch(text):
            name, constraint, id, line, said = astray.groups()
            self.astray(name, bool(constraint), id, int(line) if line else self.line, said)
        else:
            self.sentences(text)
        if lost:
            self.notes.append(f"note: with it went {lost[2]}")

    def sentences(self, text: str) -> None:
        """What is wrong with one element, or with a text that gave none."""
        if self.element is None and self.line is None:
            # A fault of the whole block; of several with one id, the last.
            self.element = self.source.document(self.block)
            self.path = "/bml" if self.element is not None else ""
        if self.element is None:
            self.broken(text)
        else:
            pieces = [self.piece(piece, self.element) for piece in _PIECE.split(text)]
            self.head = "; ".join(pieces)

    # a document that gave no block

    def broken(self, text: str) -> None:
        source, line = self.source, self.line
        if line is None:
            return
        bad = source.line(line).find("\N{REPLACEMENT CHARACTER}")
        slip = source.slip(line)
        if "got the byte" in text and bad >= 0:
            self.labels.append(Label(Spot(line, bad + 1, 1), "no such character in this encoding"))
        elif (found := _UNKNOWN_PREFIX.search(text)) and (
            at := re.search(rf"\b{re.escape(found[1])}:[\w.-]+", source.line(line))
        ):
            self.labels.append(
                Label(Spot(line, at.start() + 1, len(at[0])), "a prefix that nothing declares")
            )
            self.notes.append(f'help: add xmlns:{found[1]}="..." to the start tag of <bml>')
        elif slip is not None and "well-formed" in text:
            self.labels.append(Label(source.spot(slip.offset, slip.offset + slip.length), slip.text))
            if slip.related >= 0:
                self.labels.append(self.related(slip.related))
        else:
            self.labels.append(Label(source.whole_line(line)))

    def related(self, offset: int) -> Label:
        source = self.source
        element = next((e for e in source.elements if e.offset == offset), None)
        if element is None:
            return Label(source.spot(offset, offset + 1), "first given here", primary=False)
        return Label(source.name_spot(element), f"<{element.name}> is opened here", primary=False)

    # a fault inside one element

    def piece(self, text: str, element: Element) -> str:
        """Label one sentence; returns what of it is left for the first line."""
        meant = _MEANT.search(text)
        if meant:
            self.notes.append(f"help: did you mean {meant[1]}?")
            text = text[: meant.start()]
        listed = _LONG_LIST.search(text)
        if listed:
            text = f"{text[: listed.start()]}wanted one of those known, got {text[listed.end() :]}"
            self.notes.append(f"help: known are {listed[1]}")
        found = _ATTRIBUTE.fullmatch(text)
        if several := _ATTRIBUTES.fullmatch(text):
            given = [n for n in several[1].split(", ") if self.source.value_span(element, n)]
            found = _ATTRIBUTE.fullmatch(f"{given[0]}: {several[2]}") if given else None
        cls = self.class_of(element)
        if found is None:
            self.labels.append(Label(self.source.name_spot(element), text))
            if held := _HELD.search(text):
                self.holder(held[1], element)
            self.unknown_element(text, element, bool(meant))
            return text
        name, said = found[1], found[2]
        spec = shape_of(cls).attributes.get(name) if cls else None
        span = self.source.value_span(element, name)
        if span is None:
            self.missing(name, said, element, cls)
            return text
        self.labels.append(Label(self.spot_in(span, said), said))
        if taken := _TAKEN.search(said):
            id = self.source.id(element)
            first = self.source.named(id, line=int(taken[1]), block=self.block)
            if first is not None and first is not element:
                spot = self.source.locate_in(first, "id")
                self.labels.append(Label(spot, "the first one is here", primary=False))
        self.hints(said, spec, self.source.value(element, name), element, bool(meant))
        return text

    def holder(self, name: str, element: Element) -> None:
        """Who has what a behaviour wanted: "behaviour", or "block:behaviour" of an earlier block."""
        block, _, id = name.rpartition(":")
        other = self.source.named(id, block=block or self.block)
        if other is not None and other is not element:
            self.labels.append(Label(self.source.name_spot(other), f"{name} is here", primary=False))

    def spot_in(self, span: tuple[int, int], said: str) -> Spot:
        """The part of a value that is meant: the name in a reference, else all of it."""
        start, end = span
        value = self.source.text[start:end]
        point, behaviour = _NO_POINT.search(said), _NO_BEHAVIOUR.search(said)
        at = value.rfind(point[1]) if point else value.find(behaviour[1]) if behaviour else -1
        if at >= 0:
            length = len((point or behaviour or "")[1])
            return self.source.spot(start + at, start + at + length)
        return self.source.spot(start, end)

    def hints(self, said: str, spec: Attribute | None, value: str, element: Element, meant: bool) -> None:
        if point := _NO_POINT.search(said):
            points = self.points_of(point[2])
            if points:
                self.notes.append(f"help: {point[2]} has {_listed(points)}")
        elif _NO_BEHAVIOUR.search(said) and not meant:
            ids = list(dict.fromkeys(filter(None, map(self.source.id, self.behaviours(element)))))
            self.notes.append(f"help: there is {_listed(ids)}" if ids else "help: there is no other one")
        if spec is None:
            return
        if spec.value.words and (word := near(value.strip(), spec.value.words)) and not meant:
            self.notes.append(f'help: did you mean "{word}"?')
        if not spec.required and spec.default not in (None, ()):
            self.notes.append(f"help: without it, {spec.name} is {spec.value.write(spec.default)}")

    def missing(self, name: str, said: str, element: Element, cls: type[Any] | None) -> None:
        """An attribute that is not there: perhaps another is it, misspelt."""
        known = (
            {*shape_of(cls).attributes, *cls.sync_points} if cls and hasattr(cls, "sync_points") else set()
        )
        word = near(name, [a for a in element.attributes if a not in known and ":" not in a])
        if word is None:
            self.labels.append(Label(self.source.name_spot(element), f"{name}: {said}"))
        else:
            self.labels.append(Label(self.source.attribute_spot(element, word), f"{name}: {said}"))
            self.notes.append(f'help: did you mean {name} where it says "{word}"?')

    def unknown_element(self, text: str, element: Element, meant: bool) -> None:
        if "no behaviour " not in text or meant:
            return
        prefix, _, name = element.name.rpartition(":")
        word = near(name, {local(tag) for tag in self.vocabulary})
        if word is not None and word != name:
            self.notes.append(f'help: did you mean "{prefix}:{word}"?' if prefix else f'help: "{word}"?')

    def behaviours(self, element: Element) -> Iterator[Element]:
        """The first other behaviours of the document of an element."""
        known = {local(tag) for tag in self.vocabulary}
        others = (e for e in self.source.inside(element) if e is not element and "id" in e.attributes)
        return islice((e for e in others if e.name.rpartition(":")[2] in known), _MOST_LISTED)

    def class_of(self, element: Element) -> type[Any] | None:
        name = element.name.rpartition(":")[2]
        if name == local(Block.tag):
            return Block
        return next((cls for tag, cls in self.vocabulary.items() if local(tag) == name), None)

    def points_of(self, id: str) -> list[str]:
        element = self.source.named(id, block=self.block)
        cls = self.class_of(element) if element else None
        if element is None or cls is None:
            return []
        marks = [self.source.id(e) for e in self.source.below(element) if e.name.rpartition(":")[2] == "sync"]
        first, *rest = cls.sync_points
        return [first, *filter(None, marks), *rest]

    # constraints that cannot all hold

    def clash(self, text: str) -> None:
        """Every line that has a part in it, and what the behaviours themselves need."""
        self.path = self.path or "/bml"
        for found in _CLAUSE.finditer(text):
            left, sign, right, constraint, id, line = found.groups()
            spot = (
                self.in_constraint(id, (right, left), int(line))
                if constraint
                else self.in_behaviour(left, int(line))
            )
            self.labels.append(Label(spot, f"{left} {sign} {right}"))
            if constraint and id == self.id and (found_one := self.constraint(id, int(line))):
                self.path = self.source.path(found_one)
        self.notes += [f"note: {found[0]}" for found in _UNPLACED.finditer(text)]
        cannot = _CANNOT.match(text)
        self.head = cannot[0] if cannot else "these cannot all hold"
        if why := _BECAUSE.search(text):
            self.notes.append(f"note: {next(filter(None, why.groups()))}")

    def astray(
        self, name: str, is_constraint: bool, constraint: str | None, line: int | None, said: str
    ) -> None:
        """A reference that leads nowhere the scheduler knows."""
        element = self.element
        if element is None and is_constraint:
            element = self.constraint(constraint, line)
        elif element is None:
            element = self.source.named(name, line=line, block=self.block)
        self.path = self.source.path(element) if element is not None else self.path or "/bml"
        self.head = said
        if element is None:
            if line is not None:
                self.labels.append(Label(self.source.whole_line(line), said))
            return
        found = _REFERENCE.match(said)
        wanted = "".join(found[1].split()) if found else ""
        for one in (element, *self.source.below(element)):
            for attribute in one.attributes:
                if wanted and "".join(self.source.value(one, attribute).split()) == wanted:
                    self.labels.append(Label(self.source.locate_in(one, attribute), said))
                    return
        self.labels.append(Label(self.source.name_spot(element), said))

    def in_behaviour(self, point: str, line: int) -> Spot:
        id, _, sync = point.partition(":")
        element = self.source.named(id, line=line, block=self.block)
        if element is None:
            return self.source.whole_line(line)
        if self.source.value_span(element, sync) is None:
            for mark in self.source.below(element):
                if self.source.id(mark) == sync:
                    return self.source.locate_in(mark, "ref")
        return self.source.locate_in(element, sync)

    def constraint(self, id: str | None, line: int | None) -> Element | None:
        """A constraint by its id, or the first one on a line."""
        found = self.source.named(id, line=line) if id else None
        if found is None and line is not None:
            on = (e for e in self.source.on_line(line) if e.name.rpartition(":")[2] == "constraint")
            found = next(on, None)
        return found

    def in_constraint(self, id: str | None, refs: tuple[str, ...], line: int) -> Spot:
        source, found = self.source, self.constraint(id, line)
        if found is None:
            return source.whole_line(line)
        wanted = ["".join(str(ref).split()) for ref in refs]
        for ref in wanted:
            for element in source.below(found):
                if "".join(source.value(element, "ref").split()) == ref:
                    return source.locate_in(element, "ref")
        return source.name_spot(found)


def _listed(words: Iterable[str]) -> str:
    *most, last = words
    return f"{', '.join(most)} and {last}" if most else last
