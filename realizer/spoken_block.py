"""Blocks that speak a text with syncs, SSML and behaviours, or a sound clip."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from xml.sax.saxutils import escape, quoteattr, unescape

from bml_schema import Block, read
from bml_schema.errors import PARSING_FAILURE, Problem, did_you_mean, quoted
from bml_schema.escape import sanitized
from bml_schema.nodes import BMLA, BMLT, CORE, OWN, SSML
from realizer.behaviours.registry import VOCABULARY
from realizer.speech.ssml import EMPTY, PLAIN, SPOKEN
from realizer.text.parts import ANY_TAG as TAG

ATTRIBUTE = re.compile(r"([\w:.-]+)\s*=\s*(\"[^\"]*\"|'[^']*')")
# A tag without its ">", or with an open quote; groups: name, attributes.
BROKEN = re.compile(
    r"</?(?:[\w.-]+:)?([A-Za-z][\w.-]+)"
    r"((?:\s+[\w:.-]+\s*=\s*(?:\"[^\"<>]*\"|'[^'<>]*'|[\"']?[^\s\"'<>/]*))*)\s*/?>?"
)
BEGUN_ATTRIBUTE = re.compile(r"\s*[\w:-]+\s*")
PREFIXES = {"bmla": BMLA, "bmlt": BMLT, "realizer": OWN}
# Elements that, like behaviours, belong in the block and not in its text.
BESIDE = frozenset({"constraint", "required"})
SYNCS = frozenset({"sync", "mark", "bookmark"})
MOST = 10  # faults of the markup of one chunk that are named
QUOTES = {"&quot;": '"', "&apos;": "'"}


@dataclass(frozen=True, slots=True)
class Chunk:
    """The options of a speech and the number of a chunk."""

    speech: str  # id of the speech, and of the speech behaviour in each of its blocks
    number: int
    character: str | None = None
    language: str | None = None
    marks: Mapping[str, str] = field(default_factory=dict)  # sync of an earlier chunk -> its block

    @property
    def block(self) -> str:
        """The id of the chunk's block."""
        return f"{self.speech}.{self.number}"

    def document(self, inside: str) -> str:
        """Return the XML of the block with its content."""
        namespaces = "".join(f" xmlns:{prefix}={quoteattr(name)}" for prefix, name in PREFIXES.items())
        character = "" if self.character is None else f" characterId={quoteattr(self.character)}"
        return f'<bml xmlns="{CORE}"{namespaces} id="{self.block}"{character}>{inside}</bml>'


def text_block(text: str, chunk: Chunk, faults: Iterable[str] = ()) -> Block:
    """Return the block that speaks a text.

    <sync id="m"/> is a sync point of the speech, other SSML goes to the voice. A behaviour needs no id;
    without a sync reference it starts at its place in the text. `ID:m` refers to a sync of the speech, also
    in earlier chunks. Text that is no XML or has invalid syncs is spoken without its tags. Faults of the
    markup are a problem of the block, and lose no words.

    Args:
        faults: further ones, of the text from which this one comes.
    """
    parser = _Text(chunk)
    for fault in faults:
        parser.add_fault(fault)
    parser.read(sanitized(text))
    (item, *others) = read(chunk.document(parser.content()), VOCABULARY)
    block = item if isinstance(item, Block) and not others else None
    if block is None or (parser.spoken and all(node.id != chunk.speech for node in block.behaviours)):
        plain = _Text(chunk)
        plain.say(TAG.sub(" ", sanitized(text)))
        (spoken,) = read(chunk.document(plain.content()), VOCABULARY)
        assert isinstance(spoken, Block)
        if block is None:
            parser.add_fault(
                f"{getattr(item, 'text', 'the markup is no XML')}: the text is spoken without it"
            )
            block = spoken
        else:
            # Speak the words although their syncs are invalid; the block's own children keep the warnings.
            children = (*spoken.children, *block.children)
            block = replace(block, children=children, places={**block.places, **spoken.places})
    if not parser.faults:
        return block
    problem = Problem(
        id=f"{block.id}:{chunk.speech}",
        type=PARSING_FAILURE,
        text="; ".join(parser.faults),
        line=0,
        path="",
        dropped=False,
    )
    return replace(block, problems=(*block.problems, problem))


def clip_block(clip: str, chunk: Chunk) -> Block:
    """Return the block that plays a clip as speech."""
    sound = f"<bmlt:audiofile fileName={quoteattr('clip:' + clip)}/>"
    description = f'<description priority="1" type="audio/x-clip">{sound}</description>'
    (block,) = read(chunk.document(f'<speech id="{chunk.speech}">{description}</speech>'), VOCABULARY)
    assert isinstance(block, Block)
    return block


class _Text:
    """The parts of a block that speaks a text: its words with syncs, the same as SSML, and behaviours."""

    def __init__(self, chunk: Chunk) -> None:
        self.chunk = chunk
        self.core: list[str] = []  # <text>
        self.ssml: list[str] = []  # <speak>
        self.behaviours: list[str] = []
        self.spoken = False  # whether there are words
        self.marks: set[str] = set()
        self.faults: dict[str, None] = {}  # of the markup, in order

    def read(self, text: str) -> None:
        at = opened = 0  # the end of the last start tag of a sync
        while (tag := TAG.search(text, at)) is not None:
            self._words(text[at : tag.start()])
            at = tag.end()
            name = tag[2].rpartition(":")[2]
            if tag[1]:
                if name in SYNCS and (inside := text[opened : tag.start()].strip()):
                    self.add_fault(f"wanted an empty <{name}/>, got the text {quoted(inside)} in it")
                self._markup(tag, name)
            elif name in _behaviours() or name in BESIDE:
                at = tag.end() if tag[4] else _element_end(text, tag)
                self._behave(tag, text[tag.end() : at], name)
            elif name in SYNCS:
                opened = at
                self._sync(tag[0], tag[3])
            else:
                self._markup(tag, name)
        self._words(text[at:], is_last=True)

    def add_fault(self, text: str) -> None:
        if len(self.faults) < MOST:
            self.faults[text] = None

    def _words(self, text: str, *, is_last: bool = False) -> None:
        """Add text between tags. Of a tag without its end, only the sync counts."""
        at = 0
        for tag in BROKEN.finditer(text):
            if tag[1] in _known():
                self.say(text[at : tag.start()])
                at = len(text) if is_last and BEGUN_ATTRIBUTE.fullmatch(text, tag.end()) else tag.end()
                self.add_fault(f'wanted ">" at the end of a tag, got {quoted(text[tag.start() :])}')
                if tag[1] in SYNCS and ATTRIBUTE.search(tag[2]):
                    self._sync(tag[0], tag[2])
        self.say(text[at:])

    def say(self, text: str) -> None:
        """Add plain text, in which & and < need not be escaped."""
        self.spoken |= any(map(str.isalnum, text))
        escaped = escape(unescape(text, QUOTES))
        self.core.append(escaped)
        self.ssml.append(escaped)

    def content(self) -> str:
        if not self.spoken and not self.marks:
            return "".join(self.behaviours)
        language = self.chunk.language
        lang = "" if language is None else f" xml:lang={quoteattr(language)}"
        speech = f"<text{lang}>{''.join(self.core)}</text>"
        ssml = "".join(self.ssml)
        if re.search(r"<(?!mark\b)", ssml):
            speak = f'<speak xmlns=""{lang}>{ssml}</speak>'
            speech += f'<description priority="1" type="{SSML}">{speak}</description>'
        return f'<speech id="{self.chunk.speech}">{speech}</speech>' + "".join(self.behaviours)

    def _sync(self, tag: str, attributes: str) -> None:
        values = dict(ATTRIBUTE.findall(attributes))
        name = next((values[key] for key in ("id", "name", "mark") if key in values), "")
        if name:
            ref = f" ref={values['ref']}" if "ref" in values else ""
            self._mark(unescape(name[1:-1], QUOTES), ref)
        else:
            self.add_fault(f'wanted <sync id="..."/>, got {quoted(tag)}')

    def _mark(self, name: str, attributes: str = "") -> None:
        if name in self.marks:
            self.add_fault(f"sync: wanted an id of its own, got {quoted(name)} again")
            return
        self.marks.add(name)
        self.core.append(f"<sync id={quoteattr(name)}{attributes}/>")
        self.ssml.append(f"<mark name={quoteattr(name)}/>")

    def _markup(self, tag: re.Match[str], name: str) -> None:
        """Add an SSML tag without its prefix; unknown tags are left out."""
        if name in SPOKEN:
            self.ssml.append(f"<{tag[1]}{name}{tag[3]}{tag[4]}>")
        elif name in EMPTY:
            self.ssml.append("" if tag[1] else f"<{name}{tag[3]}/>")
        elif name not in PLAIN and not tag[1] and len(self.faults) < MOST:
            near = did_you_mean(name, sorted(_known()))
            self.add_fault(f"wanted <sync>, SSML or a behaviour, got <{name[:40]}>{near}")

    def _behave(self, tag: re.Match[str], inner: str, name: str) -> None:
        values = {key: self._resolve(value) for key, value in ATTRIBUTE.findall(tag[3])}
        if name not in BESIDE:
            values.setdefault("id", f'"b{len(self.behaviours) + 1}"')
            if not values.keys() & _behaviours()[name]:
                values["start"] = f'"{self._reference_here()}"'
        head = f"<{tag[2]}" + "".join(f" {key}={value}" for key, value in values.items())
        self.behaviours.append(f"{head}{tag[4]}>{self._resolve(inner)}")

    def _reference_here(self) -> str:
        if not self.spoken:
            return "0"
        name = f"at-{self.chunk.number}-{len(self.behaviours) + 1}"
        self._mark(name)
        return f"{self.chunk.speech}:{name}"

    def _resolve(self, value: str) -> str:
        """Add the block to references to syncs of earlier chunks."""
        speech = re.escape(self.chunk.speech)

        def with_block(match: re.Match[str]) -> str:
            block = self.chunk.marks.get(match[1])
            return match[0] if block is None else f"{block}:{match[0]}"

        return re.sub(rf"(?<![\w:.-]){speech}:([\w.-]+)", with_block, value)


def _element_end(text: str, tag: re.Match[str]) -> int:
    """Return the position behind an element's end tag; the end of the text if there is none."""
    depth = 1
    for other in TAG.finditer(text, tag.end()):
        if other[2] == tag[2] and not other[4]:
            depth += -1 if other[1] else 1
            if not depth:
                return other.end()
    return len(text)


@cache
def _known() -> frozenset[str]:
    """Return the local names of elements that text may contain."""
    return frozenset({*SPOKEN, *EMPTY, *BESIDE, *_behaviours()})


@cache
def _behaviours() -> Mapping[str, frozenset[str]]:
    return {tag.rpartition("}")[2]: frozenset(node.sync_points) for tag, node in VOCABULARY.items()}
