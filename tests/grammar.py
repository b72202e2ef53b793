"""A grammar that writes random valid documents as text: what authors write, not what our writer would.

Hypothesis draws every choice, so a failing document shrinks; the first of several choices is the plain one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cache
from typing import Any, TypeVar
from xml.sax.saxutils import escape

from hypothesis import strategies as st

from bml_schema import BMLA, BMLT, CORE, EXTENSIONS, OWN

__all__ = ["KINDS", "texts"]

T = TypeVar("T")

HOLD = ("start", "ready", "relax", "end")
STROKE = ("start", "ready", "strokeStart", "stroke", "strokeEnd", "relax", "end")
PEAK = ("start", "attackPeak", "relax", "end")
EVENT = ("start", "end")
IDS = ("a", "b", "nod1", "nod-2", "c.d", "_e", "gruß", "中", "x-1.5", "h", "i", "j")
BLOCKS = ("bml1", "b2", "my-block", "block 4", "ß.5", "b6")
TARGETS = ("cup", "0,0.1,1", "nobody", "Ann & Bob")
FACE_LEXEMES = ("SMILE", "RAISE_BROWS", "obliqueish", "anger", "CLOSE_EYES", "blink")
HEAD_LEXEMES = ("NOD", "SHAKE", "TILT", "nod")
WORDS = ("hello", "there", "my dear", "Ü 中", "a < b & c", "one, two.", "well ...")
SIDED = (1, 2, 4, 6, 12)
ANY_AU = (1, 4, 12, 17, 26, 45, 51, 61)
CHARACTERS = (None, None, "Ann", "Bob")
NAMESPACES = ("ext", EXTENSIONS), ("bmla", BMLA), ("bmlt", BMLT), ("r", OWN)


@cache
def _below(n: int) -> st.SearchStrategy[int]:
    return st.integers(0, n - 1)


@cache
def _tenths(low: int, high: int) -> st.SearchStrategy[int]:
    return st.integers(low, high)


@dataclass
class Known:
    """Ids that references may name: block -> behaviour -> sync points."""

    blocks: dict[str, dict[str, Sequence[str]]] = field(default_factory=dict)


@dataclass(frozen=True)
class Tag:
    """An element: its prefix ("" core), name, attributes in any order, content as XML."""

    prefix: str
    name: str
    attributes: tuple[tuple[str, str], ...] = ()
    content: str = ""


class Author:
    """The writer of one text; `draw` makes every choice."""

    def __init__(self, draw: st.DrawFn) -> None:
        self.draw = draw
        self.known = Known()
        self.prefix = ""
        self.block = ""

    # choices

    def pick(self, choices: Sequence[T]) -> T:
        return choices[self.draw(_below(len(choices)))]

    def often(self, n: int) -> bool:
        """Return False once in n times, and in the simplest document."""
        return self.draw(_below(n)) > 0

    def seldom(self, n: int) -> bool:
        return self.draw(_below(n)) == n - 1

    def number(self, low: int = 0, high: int = 30) -> str:
        """Return a decimal of tenths, in one of its spellings."""
        value = self.draw(_tenths(low, high))
        plain = f"{value / 10:g}"
        form = self.draw(_below(6))
        if form == 5 and value >= 0:
            return f" +{value / 10:.3f} "
        if form == 4 and 0 < value < 10:
            return f".{value}"
        return f"{value / 10:.2f}" if form == 3 else plain

    def amount(self) -> str:
        return self.number(0, 10)

    # XML

    def text(self, words: str) -> str:
        """Return character data: escaped, as CDATA, or with references to characters."""
        form = self.draw(_below(4))
        if form == 2:
            return f"<![CDATA[{words}]]>"
        if form == 3 and words:
            return f"&#{ord(words[0])};{escape(words[1:])}<!-- in between -->"
        return escape(words, {">": "&gt;"} if form else {})

    def value(self, words: str) -> str:
        """Return an attribute's value with its quotes."""
        form = self.draw(_below(4))
        quote = "'" if form == 1 else '"'
        inside = escape(words, {quote: "&quot;" if quote == '"' else "&apos;"})
        if form == 3 and words and words[0].isalnum():
            inside = f"&#x{ord(words[0]):x};{inside[1:]}"
        return f"{quote}{inside}{quote}"

    def element(self, tag: Tag) -> str:
        prefix = tag.prefix or self.prefix
        name = f"{prefix}:{tag.name}" if prefix else tag.name
        attributes = list(tag.attributes)
        if len(attributes) > 1 and self.often(2):
            attributes = [attributes[i] for i in self.draw(_orders(len(attributes)))]
        gap = self.pick((" ", " ", "\n    ", "\t"))
        equals = self.pick(("=", "=", " = "))
        inside = "".join(f"{gap}{key}{equals}{self.value(value)}" for key, value in attributes)
        if not tag.content and self.often(3):
            return f"<{name}{inside}{self.pick(('', ' '))}/>"
        return f"<{name}{inside}>{tag.content}</{name}>"

    def filler(self) -> str:
        """Return whitespace or a comment between elements."""
        return self.pick(("\n", "", "  ", "\n<!-- <bml id='no'> -->\n", "<?stop here?>\n", "\t\r\n"))

    # references

    def reference(self, own: Sequence[str] = (), id: str = "") -> str:
        """Return any valid reference, most often into the own block."""
        block = self.known.blocks[self.block]
        kind = self.draw(_below(10))
        if kind <= 2 or not block:
            return self.number(0, 40)
        if kind == 3:
            return f"bml:start{self.offset(0)}"
        if kind == 4 and own:
            return f"{id}:{own[0]}{self.offset(1)}"
        if kind == 5 and len(self.known.blocks) > 1:
            other = self.pick(list(self.known.blocks))
            points = self.known.blocks[other]
            if other != self.block and points:
                behaviour = self.pick(list(points))
                return f"{other}:{behaviour}:{self.pick(points[behaviour])}{self.offset(-5)}"
        behaviour = self.pick(list(block))
        point = self.pick(block[behaviour])
        if kind == 6:
            return f"{self.block}:{behaviour}:{point}{self.offset(-5)}"
        return f"{behaviour}:{point}{self.offset(-5)}"

    def offset(self, low: int) -> str:
        value = self.draw(_tenths(low, 12))
        if not value:
            return self.pick(("", "", "+0", " - 0.0"))
        blank = self.pick((" ", " ", ""))
        # After an id such as "a-1" no blank is needed either, because known names are tried first.
        return f"{blank}{'-' if value < 0 else '+'}{blank}{abs(value) / 10:g}"

    # behaviours

    def behaviour(self, kind: str, id: str, points: Sequence[str]) -> str:
        tag = KINDS[kind](self, id)
        attributes = [("id", id), *tag.attributes]
        for point in points if self.seldom(2) else ():
            if self.seldom(3) and point != "tm1":
                attributes.append((point, self.reference(points, id)))
        if kind in EXCLUSIVE and self.seldom(4):
            attributes.append(("bmla:priority", self.number(0, 30)))
        if self.seldom(8):
            attributes.append(self.pick((("style", "x"), ("bmlt:dynamic", "true"), ("xml:lang", "de"))))
        content = tag.content
        if kind not in WITHOUT_DESCRIPTION and self.seldom(8):
            content += self.description()
        return self.element(Tag(tag.prefix, tag.name, tuple(attributes), content))

    def description(self) -> str:
        inside = self.pick(("<any xmlns='urn:x' a='1'>thing</any>", "words", ""))
        return self.element(Tag("", "description", (("priority", "2"), ("type", "text/x-own")), inside))

    def constraint(self, n: int) -> str:
        parts = ""
        for _ in range(1 + self.seldom(3)):
            kind = self.pick(("synchronize", "before", "after"))
            syncs = "".join(
                self.filler() + self.element(Tag("", "sync", (("ref", self.reference()),)))
                for _ in range(2 if kind == "synchronize" else self.pick((1, 2)))
            )
            attributes = () if kind == "synchronize" else (("ref", self.reference()),)
            parts += self.element(Tag("", kind, attributes, syncs))
        return self.element(Tag("", "constraint", (("id", f"k{n}"),) if self.often(3) else (), parts))

    # documents

    def document(self, number: int) -> str:
        self.block = BLOCKS[number]
        kinds = [self.pick(FREQUENT) for _ in range(self.draw(_below(5)) + 1)]
        ids = [IDS[(self.draw(_below(2)) + 2 * n) % len(IDS)] for n in range(len(kinds))]
        points = {id: self.points(kind) for kind, id in zip(kinds, ids, strict=True)}
        self.known.blocks[self.block] = points
        bare = self.pick(("core", "none", "prefix"))
        self.prefix = "bml" if bare == "prefix" else ""
        children = [self.behaviour(kind, id, points[id]) for kind, id in zip(kinds, ids, strict=True)]
        children += [self.constraint(n) for n in range(self.pick((0, 0, 1, 2)))]
        if len(children) > 1 and self.seldom(2):
            children = [children[i] for i in self.draw(_orders(len(children)))]
        if self.seldom(4):
            cut = self.draw(_below(len(children)))
            inside = "".join(self.filler() + child for child in children[cut:])
            children[cut:] = [self.element(Tag("", "required", (), inside or "<!-- none -->"))]
        content = "".join(self.filler() + child for child in children) + self.filler()
        spaces = {"core": (("xmlns", CORE),), "none": (), "prefix": (("xmlns:bml", CORE),)}[bare]
        declared = tuple((f"xmlns:{prefix}", uri) for prefix, uri in NAMESPACES)
        return self.element(
            Tag("", "bml", (*spaces, *declared, ("id", self.block), *self.block_attributes(number)), content)
        )

    def points(self, kind: str) -> Sequence[str]:
        points = POINTS[kind]
        if kind == "speech":
            return ("start", "tm1", "end")
        return points

    def block_attributes(self, number: int) -> list[tuple[str, str]]:
        attributes = []
        character = self.pick(CHARACTERS)
        if character:
            attributes.append(("characterId", character))
        composition = self.pick((None, None, "MERGE", "APPEND", "REPLACE", "append"))
        if composition:
            attributes.append(("composition", composition))
        if number and self.seldom(3):
            name = self.pick(
                ("appendAfter", "chunkAfter", "prependBefore", "chunkBefore", "interrupt", "onStart")
            )
            attributes.append((f"bmla:{name}", self.pick((BLOCKS[0], f"{BLOCKS[0]}, {BLOCKS[number - 1]}"))))
        if self.seldom(12):
            attributes.append(("bmla:preplan", "true"))
        return attributes

    def whole(self) -> str:
        """Return one to three documents."""
        before = self.pick(("", "", "\ufeff", '<?xml version="1.0" encoding="UTF-8"?>\n', "<!-- hello -->"))
        documents = [self.document(n) for n in range(self.pick((1, 1, 1, 2, 3)))]
        between = self.pick(("\n", "", "<!-- next -->"))
        return before + between.join(documents) + self.pick(("", "\n"))


@cache
def _orders(n: int) -> st.SearchStrategy[list[int]]:
    return st.permutations(range(n))


# What the elements hold beside id and sync points; one function a kind.


def _gaze(a: Author, id: str) -> Tag:
    attributes = [("target", a.pick(TARGETS))]
    if a.seldom(2):
        attributes.append(("influence", a.pick(("EYES", "HEAD", "WHOLE", "NECK"))))
    if a.seldom(3):
        attributes += [("offsetAngle", a.number(-300, 300)), ("offsetDirection", a.pick(("LEFT", "UPRIGHT")))]
    return Tag("", "", tuple(attributes))


def _head(a: Author, id: str) -> Tag:
    attributes = [("lexeme", a.pick(HEAD_LEXEMES))]
    if a.seldom(2):
        attributes.append(("amount", a.amount()))
    if a.seldom(3):
        attributes.append(("repetition", a.pick(("1", "2", "3"))))
    return Tag("", "head", tuple(attributes))


def _lexeme(a: Author, id: str) -> Tag:
    attributes = [("lexeme", a.pick(FACE_LEXEMES)), ("amount", a.amount())]
    if a.seldom(4):
        attributes.append(("overshoot", a.number(-5, 5)))
    return Tag("", "faceLexeme", tuple(attributes))


def _facs(a: Author, id: str) -> Tag:
    attributes = [("amount", a.amount())]
    if a.seldom(2):
        attributes += [("au", str(a.pick(SIDED))), ("side", a.pick(("LEFT", "RIGHT", "BOTH")))]
    else:
        attributes.append(("au", str(a.pick(ANY_AU))))
    return Tag("ext", "faceFacs", tuple(attributes))


def _parts(a: Author) -> str:
    parts = [a.element(a.pick((_lexeme, _facs))(a, "")) for _ in range(a.pick((1, 1, 2, 3)))]
    return "".join(a.filler() + part for part in parts)


def _speech(a: Author, id: str) -> Tag:
    first, last = a.text(a.pick(WORDS)), a.text(a.pick(WORDS))
    mark = (("id", "tm1"), ("ref", a.reference())) if a.seldom(5) else (("id", "tm1"),)
    inside = f"{first} {a.element(Tag('', 'sync', mark))} {last}"
    content = a.element(Tag("", "text", (), inside))
    if a.seldom(4):
        spoken = '<speak xmlns="http://www.w3.org/2001/10/synthesis">so <mark name="tm1"/> be it</speak>'
        content += a.element(
            Tag("", "description", (("priority", "1"), ("type", "application/ssml+xml")), spoken)
        )
    return Tag("", "speech", (), content)


def _posture(a: Author, id: str) -> Tag:
    content = a.element(Tag("", "stance", (("type", a.pick(("STANDING", "SITTING"))),)))
    if a.seldom(2):
        content += a.element(Tag("", "pose", (("part", "ARMS"), ("lexeme", "ARMS_CROSSED"))))
    return Tag("", "", (), content)


def _emotion(a: Author, id: str) -> Tag:
    where: tuple[tuple[str, str], ...] = (("name", a.pick(("joy", "fear", "Sadness", "worried"))),)
    if a.seldom(3):
        where = (("angle", a.number(0, 3600)),)
    return Tag("r", "", (*where, ("intensity", a.amount())))


def _change(a: Author, id: str) -> Tag:
    block = a.pick(list(a.known.blocks))
    target = f"{block}:{a.pick(list(a.known.blocks[block]))}"
    curve = (("type", a.pick(("linear", "instant"))), ("targetValue", a.amount()))
    return Tag(
        "bmla",
        "parametervaluechange",
        (("target", target), ("paramId", a.pick(("amount", "volume")))),
        a.element(Tag("bmla", "trajectory", curve)),
    )


def _interrupt(a: Author, id: str) -> Tag:
    block = a.pick(list(a.known.blocks))
    attributes = [("target", block)]
    if a.seldom(2):
        attributes.append((a.pick(("include", "exclude")), a.pick(list(a.known.blocks[block]))))
    return Tag("bmla", "interrupt", tuple(attributes))


def _keys(a: Author, id: str) -> Tag:
    kind, parts = a.pick((("FACS", "1.BOTH 12.LEFT"), ("FAPS", "31 32")))
    keys = "0 0 0\n0.4 0.5 0.5\n0.9 0 0"
    return Tag(
        "bmlt",
        "facekeyframe",
        (("type", kind),),
        a.element(Tag("bmlt", "FaceInterpolator", (("parts", parts),), keys)),
    )


def _named(name: str, prefix: str, make: Callable[[Author, str], Tag]) -> Callable[[Author, str], Tag]:
    def make_it(a: Author, id: str) -> Tag:
        tag = make(a, id)
        return Tag(prefix, name, tag.attributes, tag.content)

    return make_it


def _with(name: str, prefix: str = "", /, **attributes: Any) -> Callable[[Author, str], Tag]:
    """Attributes as tuples of choices, or a function of the author."""

    def make(a: Author, id: str) -> Tag:
        pairs = ((key, some(a) if callable(some) else a.pick(some)) for key, some in attributes.items())
        return Tag(prefix, name, tuple(pairs))

    return make


def _face(name: str) -> Callable[[Author, str], Tag]:
    return lambda a, id: Tag("", name, (("amount", a.amount()),) if a.seldom(2) else (), _parts(a))


KINDS: dict[str, Callable[[Author, str], Tag]] = {
    "head": _head,
    "faceLexeme": _lexeme,
    "faceFacs": _facs,
    "speech": _speech,
    "gaze": _named("gaze", "", _gaze),
    "wait": lambda a, id: Tag("", "wait", (("duration", a.number(0, 12)),) if a.often(3) else ()),
    "face": _face("face"),
    "faceShift": _face("faceShift"),
    "gazeShift": _named("gazeShift", "", _gaze),
    "headDirectionShift": _with("headDirectionShift", target=TARGETS),
    "gesture": _with("gesture", lexeme=("BEAT", "WAVE"), mode=("LEFT_HAND", "BOTH_HANDS")),
    "pointing": _with("pointing", target=TARGETS),
    "locomotion": _with("locomotion", target=TARGETS, manner=("WALK", "RUN")),
    "posture": _named("posture", "", _posture),
    "postureShift": _named("postureShift", "", _posture),
    "emotion": _named("emotion", "r", _emotion),
    "mood": _named("mood", "r", _emotion),
    "expression": _with("expression", "r", name=("template:astonishment", "template:grief", "nothing")),
    "faps": lambda a, id: Tag(
        "r", "faps", (), a.element(Tag("r", "fap", (("number", "31"), ("value", a.number(0, 3000)))))
    ),
    "fapFile": _with("fapFile", "r", fileName=("no-such.fap", "../out.fap")),
    "timeline": _with("timeline", "r", fileName=("no-such.toml", "../out.json")),
    "blink": _with("blink", "r", side=("BOTH", "LEFT"), amount=Author.amount),
    "idle": _with("idle", "r", blinks=Author.amount, motion=Author.amount),
    "listen": _with("listen", "r", intensity=Author.amount),
    "interrupt": _interrupt,
    "activate": lambda a, id: Tag("bmla", "activate", (("target", a.pick(list(a.known.blocks))),)),
    "parametervaluechange": _change,
    "audiofile": _with("audiofile", "bmlt", fileName=("no-such.wav",)),
    "blinkemitter": _with("blinkemitter", "bmlt", avgwaitingtime=("1", "2.5")),
    "facekeyframe": _keys,
}
POINTS: dict[str, Sequence[str]] = {
    **dict.fromkeys(KINDS, EVENT),
    **dict.fromkeys(("head", "gesture", "pointing"), STROKE),
    **dict.fromkeys(("gaze", "posture"), HOLD),
    **dict.fromkeys(("face", "faceLexeme", "faceFacs", "emotion", "expression", "faps", "blink"), PEAK),
}
# Frequent elements come first and more than once.
FREQUENT = (*list(KINDS)[:7], *list(KINDS)[:7], *list(KINDS))
EXCLUSIVE = frozenset({"head", "gaze", "gesture", "facekeyframe"})
WITHOUT_DESCRIPTION = frozenset({"parametervaluechange", "facekeyframe"})


@st.composite
def texts(draw: st.DrawFn) -> str:
    """A text of one to three valid documents: every behaviour, reference and constraint of BML 1.0, BMLA,
    BMLT and our own, in any namespace style, attribute order and quoting.
    """
    return Author(draw).whole()
