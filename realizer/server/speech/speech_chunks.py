"""Conversion of chunks of text, with syncs, SSML and behaviours, to blocks."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from xml.sax.saxutils import escape, quoteattr, unescape

from bml_schema import Block, read
from bml_schema.escape import sanitized
from bml_schema.nodes import BMLA, BMLT, CORE, OWN
from realizer.behaviours.registry import VOCABULARY
from realizer.server.speech.sentence_splitter import TAG
from realizer.speech.ssml import EMPTY, SPOKEN

ATTRIBUTE = re.compile(r"([\w:.-]+)\s*=\s*(\"[^\"]*\"|'[^']*')")
# An incomplete tag at the end of the text.
BROKEN = re.compile(r"</?(?:[\w.-]+:)?([A-Za-z][\w.-]+)(?:\s[^<>]*)?$")
PREFIXES = {"bmla": BMLA, "bmlt": BMLT, "realizer": OWN}
# Elements that, like behaviours, belong in the block and not in its text.
BESIDE = frozenset({"constraint", "required"})
SYNCS = frozenset({"sync", "mark", "bookmark"})
QUOTES = {"&quot;": '"', "&apos;": "'"}


@dataclass(frozen=True, slots=True)
class Chunk:
    """The options of a speech and the number of a chunk.

    Attributes:
        speech: id of the speech, and of the speech behaviour in each of its blocks.
        number: 1, 2, ...
        marks: sync of an earlier chunk -> its block.
    """

    speech: str
    number: int
    character: str | None = None
    language: str | None = None
    marks: Mapping[str, str] = field(default_factory=dict)

    @property
    def block(self) -> str:
        """The id of the chunk's block."""
        return f"{self.speech}.{self.number}"

    def document(self, inside: str) -> str:
        """Return the XML of the block with its content."""
        declared = "".join(f" xmlns:{prefix}={quoteattr(name)}" for prefix, name in PREFIXES.items())
        who = "" if self.character is None else f" characterId={quoteattr(self.character)}"
        return f'<bml xmlns="{CORE}"{declared} id="{self.block}"{who}>{inside}</bml>'


def text_block(text: str, chunk: Chunk) -> Block:
    """Return the block that speaks a text.

    <sync id="m"/> is a sync point of the speech, other SSML goes to the voice. A behaviour needs no id;
    without a sync reference it starts at its place in the text. `ID:m` refers to a sync of the speech, also
    in earlier chunks. Text that is no XML or has invalid syncs is spoken without its tags. An incomplete tag
    at the end is removed.
    """
    work = _Text(chunk)
    work.read(sanitized(text))
    found = list(read(chunk.document(work.inside()), VOCABULARY))
    block = found[0] if len(found) == 1 and isinstance(found[0], Block) else None
    if block is not None and (not work.spoken or any(node.id == chunk.speech for node in block.behaviours)):
        return block
    plain = _Text(chunk)
    plain.say(TAG.sub(" ", sanitized(text)))
    (spoken,) = read(chunk.document(plain.inside()), VOCABULARY)
    assert isinstance(spoken, Block)
    if block is None:
        return spoken
    # Speak the words although their syncs are invalid; the block's own children keep the warnings about them.
    children = (*spoken.children, *block.children)
    return replace(block, children=children, places={**block.places, **spoken.places})


def clip_block(clip: str, chunk: Chunk) -> Block:
    """Return the block that plays a clip as speech."""
    sound = f"<bmlt:audiofile fileName={quoteattr('clip:' + clip)}/>"
    said = f'<description priority="1" type="audio/x-clip">{sound}</description>'
    (block,) = read(chunk.document(f'<speech id="{chunk.speech}">{said}</speech>'), VOCABULARY)
    assert isinstance(block, Block)
    return block


class _Text:
    """A parser of a chunk's text."""

    def __init__(self, chunk: Chunk) -> None:
        self.chunk = chunk
        self.core: list[str] = []  # <text>
        self.ssml: list[str] = []  # <speak>
        self.behaviours: list[str] = []
        self.spoken = False  # whether there are words
        self.marked = False

    def read(self, text: str) -> None:
        """Parse the text into words, marks and behaviours."""
        at = 0
        while (tag := TAG.search(text, at)) is not None:
            self.say(text[at : tag.start()])
            at = tag.end()
            name = tag[2].rpartition(":")[2]
            if tag[1]:
                self._markup(tag, name)
            elif name in _behaviours() or name in BESIDE:
                at = tag.end() if tag[4] else _closed(text, tag)
                self._behave(tag, text[tag.end() : at], name)
            elif name in SYNCS:
                values = dict(ATTRIBUTE.findall(tag[3]))
                named = next((values[key] for key in ("id", "name", "mark") if key in values), None)
                if named is not None:
                    self._mark(unescape(named[1:-1], QUOTES), _written(values, {"ref"}))
            else:
                self._markup(tag, name)
        rest = text[at:]
        if (broken := BROKEN.search(rest)) and _known(broken[1]):
            rest = rest[: broken.start()]
        self.say(rest)

    def say(self, text: str) -> None:
        """Add plain text, in which & and < need not be escaped."""
        self.spoken |= any(map(str.isalnum, text))
        written = escape(unescape(text, QUOTES))
        self.core.append(written)
        self.ssml.append(written)

    def inside(self) -> str:
        """Return the content of the block."""
        if not self.spoken and not self.marked:
            return "".join(self.behaviours)
        language = self.chunk.language
        spoken_in = "" if language is None else f" xml:lang={quoteattr(language)}"
        said = f"<text{spoken_in}>{''.join(self.core)}</text>"
        ssml = "".join(self.ssml)
        if re.search(r"<(?!mark\b)", ssml):
            speak = f'<speak xmlns=""{spoken_in}>{ssml}</speak>'
            said += f'<description priority="1" type="application/ssml+xml">{speak}</description>'
        return f'<speech id="{self.chunk.speech}">{said}</speech>' + "".join(self.behaviours)

    def _mark(self, name: str, more: str = "") -> None:
        self.marked = True
        self.core.append(f"<sync id={quoteattr(name)}{more}/>")
        self.ssml.append(f"<mark name={quoteattr(name)}/>")

    def _markup(self, tag: re.Match[str], name: str) -> None:
        """Add an SSML tag without its prefix; unknown tags are left out."""
        if name in SPOKEN or name in EMPTY:
            self.ssml.append(f"<{tag[1]}{name}{tag[3]}{tag[4]}>")

    def _behave(self, tag: re.Match[str], inner: str, name: str) -> None:
        values = {key: self._referring(value) for key, value in ATTRIBUTE.findall(tag[3])}
        if name not in BESIDE:
            values.setdefault("id", f'"b{len(self.behaviours) + 1}"')
            if not values.keys() & _behaviours()[name]:
                values["start"] = f'"{self._here()}"'
        head = f"<{tag[2]}" + "".join(f" {key}={value}" for key, value in values.items())
        self.behaviours.append(f"{head}{tag[4]}>{self._referring(inner)}")

    def _here(self) -> str:
        """Return a reference to this place in the text."""
        if not self.spoken:
            return "0"
        name = f"at-{self.chunk.number}-{len(self.behaviours) + 1}"
        self._mark(name)
        return f"{self.chunk.speech}:{name}"

    def _referring(self, value: str) -> str:
        """Add the block to references to syncs of earlier chunks."""
        speech = re.escape(self.chunk.speech)

        def place(found: re.Match[str]) -> str:
            block = self.chunk.marks.get(found[1])
            return found[0] if block is None else f"{block}:{found[0]}"

        return re.sub(rf"(?<![\w:.-]){speech}:([\w.-]+)", place, value)


def _written(values: Mapping[str, str], names: Iterable[str]) -> str:
    return "".join(f" {key}={values[key]}" for key in names if key in values)


def _closed(text: str, tag: re.Match[str]) -> int:
    """Return the position behind an element's end tag; the end of the text if there is none."""
    depth = 1
    for other in TAG.finditer(text, tag.end()):
        if other[2] == tag[2] and not other[4]:
            depth += -1 if other[1] else 1
            if not depth:
                return other.end()
    return len(text)


@cache
def _behaviours() -> Mapping[str, frozenset[str]]:
    """Return the sync points of behaviours, by the elements' names."""
    return {tag.rpartition("}")[2]: frozenset(node.sync_points) for tag, node in VOCABULARY.items()}


def _known(name: str) -> bool:
    return name in SPOKEN or name in EMPTY or name in BESIDE or name in _behaviours()
