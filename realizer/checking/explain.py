"""Findings that explain warnings with marked places and suggestions."""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from itertools import islice
from typing import Any

from bml_schema import Block
from bml_schema.node_schema import Attribute, local, schema_of
from bml_schema.reading.tolerant_scanner import Element
from bml_schema.source import Source, Spot
from realizer.checking.explain_conflicts import explain_conflict
from realizer.checking.finding import Finding, FindingBuilder, Label
from realizer.core.similar import similar
from realizer.scheduling.timing import Warning

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
_HELD = re.compile(r"but (\S+) has it from")
_UNKNOWN_PREFIX = re.compile(r"Namespace prefix (\S+)(?: for \S+)? on (\S+) is not defined")
_MAX_LISTED = 12


def finding_of(file: str, source: Source, warning: Warning, vocabulary: Mapping[str, type[Any]]) -> Finding:
    """Return the finding for a warning.

    Args:
        file: name of the file.
        source: the text with its positions.
        warning: its text begins with "line N, path: " if the place is known.
        vocabulary: Clark tag -> node class, for suggestions.
    """
    placed = _PLACED.fullmatch(warning.text)
    line, path, text = (int(placed[1]), placed[2] or "", placed[3]) if placed else (None, "", warning.text)
    builder = _Sentences(source, warning.id, line, path, vocabulary=vocabulary)
    lost = _LOST.fullmatch(text)
    sentence = lost[1] if lost else text
    if not explain_conflict(builder, warning, sentence):
        builder.explain(sentence)
    if lost:
        builder.notes.append(f"note: with it went {lost[2]}")
    return Finding(
        file=file,
        type=warning.type,
        id=warning.id,
        path=path or builder.path,
        text=text,
        head=builder.head or text,
        labels=tuple(builder.labels),
        notes=tuple(dict.fromkeys(builder.notes)),
    )


def near(word: str, choices: Iterable[str], cutoff: float = 0.6) -> str | None:
    """Return the choice that is most similar to a word, ignoring case, or None."""
    by_case = {choice.lower(): choice for choice in choices}
    found = similar(word.lower(), by_case, 1, cutoff)
    return by_case[found[0]] if found else None


def attributes_of(text: str) -> list[str]:
    """Return the attribute names that a warning mentions, from its text without place."""
    lost = _LOST.fullmatch(text)
    names: list[str] = []
    for piece in _PIECE.split(lost[1] if lost else text):
        found = _ATTRIBUTES.fullmatch(piece) or _ATTRIBUTE.fullmatch(piece)
        names += found[1].split(", ") if found else []
    return names


@dataclass
class _Sentences(FindingBuilder):
    """Explains warnings of the parser and of behaviour kinds, each about one element."""

    vocabulary: Mapping[str, type[Any]] = field(default_factory=dict)

    def explain(self, text: str) -> None:
        if self.element is None and self.line is None:
            # A fault of the whole block; of several blocks with this id, the last.
            self.element = self.source.document(self.block)
            self.path = "/bml" if self.element is not None else ""
        if self.element is None:
            self.broken(text)
        else:
            element = self.element
            self.head = "; ".join(self.piece(piece, element) for piece in _PIECE.split(text))

    def broken(self, text: str) -> None:
        """Explain why a part of a document is not a block."""
        source, line = self.source, self.line
        if line is None:
            return
        bad = source.line(line).find("\N{REPLACEMENT CHARACTER}")
        slip = source.error_on_line(line)
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

    def piece(self, text: str, element: Element) -> str:
        """Label one sentence and return the part of it for the first line."""
        meant = _MEANT.search(text)
        if meant:
            self.notes.append(f"help: did you mean {meant[1]}?")
            text = text[: meant.start()]
        listed = _LONG_LIST.search(text)
        if listed:
            text = f"{text[: listed.start()]}wanted a known one, got {text[listed.end() :]}"
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
                if ":" in held[1]:
                    self.notes.append('help: with composition="APPEND" the block waits for the other one')
            self.unknown_element(text, element, bool(meant))
            return text
        name, message = found[1], found[2]
        spec = schema_of(cls).attributes.get(name) if cls else None
        span = self.source.value_span(element, name)
        if span is None:
            self.missing(name, message, element, cls)
            return text
        self.labels.append(Label(self.spot_in(span, message), message))
        if taken := _TAKEN.search(message):
            id = self.source.id(element)
            first = self.source.named(id, line=int(taken[1]), block=self.block)
            if first is not None and first is not element:
                spot = self.source.locate_in(first, "id")
                self.labels.append(Label(spot, "the first one is here", primary=False))
        self.hints(message, spec, self.source.value(element, name), element, bool(meant))
        return text

    def holder(self, name: str, element: Element) -> None:
        """Label the holder of a resource, "behaviour" or "block:behaviour"."""
        block, _, id = name.rpartition(":")
        other = self.source.named(id, block=block or self.block)
        if other is not None and other is not element:
            self.labels.append(Label(self.source.name_spot(other), f"{name} is here", primary=False))

    def spot_in(self, span: tuple[int, int], message: str) -> Spot:
        """Return the name in a reference that a message is about, or else the whole value."""
        start, end = span
        value = self.source.text[start:end]
        point, behaviour = _NO_POINT.search(message), _NO_BEHAVIOUR.search(message)
        at = value.rfind(point[1]) if point else value.find(behaviour[1]) if behaviour else -1
        if at >= 0:
            length = len((point or behaviour or "")[1])
            return self.source.spot(start + at, start + at + length)
        return self.source.spot(start, end)

    def hints(self, message: str, spec: Attribute | None, value: str, element: Element, meant: bool) -> None:
        if point := _NO_POINT.search(message):
            points = self.points_of(point[2])
            if points:
                self.notes.append(f"help: {point[2]} has {_listed(points)}")
        elif _NO_BEHAVIOUR.search(message) and not meant:
            ids = list(dict.fromkeys(filter(None, map(self.source.id, self.behaviours(element)))))
            self.notes.append(f"help: there is {_listed(ids)}" if ids else "help: there is no other one")
        if spec is None:
            return
        if spec.value.words and (word := near(value.strip(), spec.value.words)) and not meant:
            self.notes.append(f'help: did you mean "{word}"?')
        if not spec.required and spec.default not in (None, ()):
            self.notes.append(f"help: without it, {spec.name} is {spec.value.write(spec.default)}")

    def missing(self, name: str, message: str, element: Element, cls: type[Any] | None) -> None:
        """Explain a missing attribute, of which another may be a misspelling."""
        known = (
            {*schema_of(cls).attributes, *cls.sync_points} if cls and hasattr(cls, "sync_points") else set()
        )
        word = near(name, [a for a in element.attributes if a not in known and ":" not in a])
        if word is None:
            self.labels.append(Label(self.source.name_spot(element), f"{name}: {message}"))
        else:
            self.labels.append(Label(self.source.attribute_spot(element, word), f"{name}: {message}"))
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
        return islice((e for e in others if e.name.rpartition(":")[2] in known), _MAX_LISTED)

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


def _listed(words: Iterable[str]) -> str:
    *most, last = words
    return f"{', '.join(most)} and {last}" if most else last
