"""A parser of SSML: text, marks, breaks and tags."""

import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from xml.parsers import expat
from xml.sax.saxutils import quoteattr, unescape

from bml_schema.errors import did_you_mean
from bml_schema.escape import ILLEGAL
from bml_schema.reading.ssml import APART, HIDDEN
from realizer.core.errors import VoiceError
from realizer.speech.ssml_prosody import EMPHASIS, is_supported
from realizer.speech.utterance import MAX_TEXT, SpeechRequest
from realizer.text.numbers import numbers_in_words

LONGEST_BREAK = 10.0  # s; longer silences are a scheduling matter, not a voice's
LONGEST_ATTRIBUTE = 200  # characters; engines copy attributes into fixed buffers

# SSML 1.1 elements that change how text is spoken, with the attributes that are passed on. `audio` has none,
# because an engine would open the file that it names.
SPOKEN: Mapping[str, tuple[str, ...]] = {
    "audio": (),
    "emphasis": ("level",),
    "lang": ("xml:lang",),
    "p": ("xml:lang",),
    "phoneme": ("alphabet", "ph"),
    "prosody": ("rate", "pitch", "volume", "range", "contour"),
    "s": ("xml:lang",),
    "say-as": ("interpret-as",),
    "sub": ("alias",),
    "voice": ("xml:lang", "name", "gender", "age", "variant"),
}
EMPTY = ("break", "mark", "bookmark", "sync")
# Elements without an effect on speech: their text is spoken unchanged.
PLAIN = frozenset({"lookup", "speak", "token", "w"})
OTHER_NAMES = {"paragraph": "p", "sentence": "s"}  # of SSML 1.0
# What <say-as> can interpret: as characters, as digits, and as a number, which every voice does.
CHARACTERS = frozenset({"characters", "spell-out", "verbatim", "letters"})
DIGITS = frozenset({"digits", "telephone"})
NUMBERS = frozenset({"cardinal", "number"})
STRENGTHS = {"none": 0.0, "x-weak": 0.1, "weak": 0.2, "medium": 0.4, "strong": 0.7, "x-strong": 1.2}  # s
CLOCK = re.compile(r"\s*\+?(\d+(?:\.\d+)?|\.\d+)\s*(ms|s)\s*")

PICTURES = re.compile(
    "[\U0001f000-\U0001faff\u2600-\u27bf\u2b00-\u2bff\ufe00-\ufe0f\u200d\u20e3\U000e0000-\U000e007f]+"
    r"|(?<!\S)<3(?=[\s.,!?]|$)"  # a heart
)
BEFORE_SIGN = re.compile(r"\s+(?=[.,;!?])")
MARKUP = re.compile(r"<[^<>]*>")
AS_GIVEN = frozenset({"phoneme", "say-as", "sub"})  # what they say is in their attributes
NAMED = re.compile(
    r"<(?:\w+:)?(?:mark|bookmark|sync)\b[^<>]*?\b(?:name|mark|id)\s*=\s*(?:\"([^\"]*)\"|'([^']*)')"
)


@dataclass(frozen=True, slots=True)
class Mark:
    name: str


@dataclass(frozen=True, slots=True)
class Break:
    seconds: float


@dataclass(frozen=True, slots=True)
class Tag:
    """The start of an SSML element, or its end (`attributes` is then None)."""

    name: str
    attributes: tuple[tuple[str, str], ...] | None


Part = str | Mark | Break | Tag


@dataclass(frozen=True, slots=True)
class Script:
    """A parsed text."""

    # text (not empty, blanks collapsed), marks, breaks, and properly nested tags, in order
    parts: tuple[Part, ...]
    warnings: tuple[str, ...] = field(default=())  # sentences about what was ignored

    @property
    def text(self) -> str:
        return "".join(part for part in self.parts if isinstance(part, str))

    @property
    def marks(self) -> tuple[str, ...]:
        """The names of the marks in the order of the text."""
        return tuple(part.name for part in self.parts if isinstance(part, Mark))

    @property
    def is_silent(self) -> bool:
        return not any(unicodedata.category(c)[0] in "LNS" for c in self.text)


def read_script(request: SpeechRequest) -> Script:
    """Parse the SSML of a request. Malformed SSML is read as plain text with marks, with a warning.

    Control characters, lone surrogates, emoji, elements that are not SSML (but not their text), marks without
    a name or with that of an earlier one, and unknown values are ignored with a warning; attributes that are
    not SSML are ignored silently.

    Raises:
        VoiceError: if the text is longer than `MAX_TEXT` characters.
    """
    if len(request.ssml) > MAX_TEXT:
        raise VoiceError(
            f"wanted a text of at most {MAX_TEXT} characters, got {len(request.ssml)}: "
            "split it over several behaviours"
        )
    warnings: list[str] = []
    ssml, wrong = ILLEGAL.subn(" ", request.ssml)
    if wrong:
        warnings.append(f"{wrong} control characters in the text are ignored")
    try:
        parts, odd = _parse(ssml)
        warnings += odd
    except expat.ExpatError as error:
        warnings.append(f"the text is not well-formed SSML ({error}): spoken as plain text")
        parts = list(_scrape(ssml))
    if any(isinstance(part, Mark) and not part.name for part in parts):
        warnings.append("a mark without a name is ignored")
    names = [part.name for part in parts if isinstance(part, Mark) and part.name]
    for name in sorted({name for name in names if names.count(name) > 1}):
        warnings.append(f"there are several marks {name!r}: the first one is used")
    firsts = {part.name: part for part in reversed(parts) if isinstance(part, Mark) and part.name}
    parts = [part for part in parts if not isinstance(part, Mark) or part is firsts.get(part.name)]
    if any(isinstance(part, str) and PICTURES.search(part) for part in parts):
        warnings.append("emoji in the text are not spoken")
        parts = [
            BEFORE_SIGN.sub("", PICTURES.sub(" ", part)) if isinstance(part, str) else part for part in parts
        ]
    script = Script(tuple(_numbers_in_words(collapsed(parts), request.language)))
    if script.is_silent:
        warnings.append("the text is empty: nothing is spoken")
    return Script(script.parts, tuple(warnings))


def _parse(ssml: str) -> tuple[list[Part], list[str]]:
    parts: list[Part] = []
    odd: list[str] = []
    hidden = 0  # depth inside elements whose text is not spoken
    spelled = [frozenset[str]()]  # what the open elements spell: of <say-as>, outermost first
    replaced: list[bool] = []  # of the open elements <sub>: whether an alias replaces the text
    reader = expat.ParserCreate()
    reader.buffer_text = True

    def start(name: str, attributes: dict[str, str]) -> None:
        nonlocal hidden
        name = _name(name)
        hidden += name in HIDDEN
        if name in APART:
            parts.append(" ")
        if name in EMPTY:
            parts.extend(_point(name, attributes, odd))
        elif name == "say-as":
            odd.extend(_unsupported(name, attributes))
            kind = attributes.get("interpret-as", "")
            spelled.append(next((kinds for kinds in (CHARACTERS, DIGITS) if kind in kinds), frozenset()))
            if spelled[-1] is CHARACTERS:
                parts.append(Tag(name, (("interpret-as", "characters"),)))
        elif name == "sub" and not attributes.get("alias", "").strip():
            replaced.append(False)
            odd.append("<sub> has no alias: its text is spoken")
        elif name in SPOKEN:
            if name == "sub":
                replaced.append(True)
            odd.extend(_unsupported(name, attributes))
            kept = ((k, attributes[k][:LONGEST_ATTRIBUTE]) for k in SPOKEN[name] if k in attributes)
            parts.append(Tag(name, tuple(kept)))
        elif name not in PLAIN | HIDDEN:
            near = did_you_mean(name, (*SPOKEN, *EMPTY))
            odd.append(f"<{name[:40]}> is not SSML for speech{near}: it is ignored, but its text is spoken")

    def end(name: str) -> None:
        nonlocal hidden
        name = _name(name)
        hidden -= name in HIDDEN
        is_kept = spelled.pop() is CHARACTERS if name == "say-as" else name != "sub" or replaced.pop()
        if name in SPOKEN and is_kept:
            parts.append(Tag(name, None))
        if name in APART:
            parts.append(" ")

    def text(characters: str) -> None:
        if spelled[-1] is DIGITS:
            characters = re.sub(r"(?<=\w)(?=\w)", " ", characters)
        if not hidden:
            parts.append(characters)

    reader.StartElementHandler = start
    reader.EndElementHandler = end
    reader.CharacterDataHandler = text
    reader.Parse(f"<speak>{ssml}</speak>".encode(), True)
    return parts, list(dict.fromkeys(odd))


def _name(tag: str) -> str:
    name = tag.rpartition(":")[2]
    return OTHER_NAMES.get(name, name)


def _unsupported(name: str, attributes: Mapping[str, str]) -> Iterator[str]:
    """Yield a sentence for each value of an attribute that no voice understands."""
    if name == "prosody":
        for key, value in attributes.items():
            if not is_supported(key, value):
                yield f'{key}="{value[:40]}" of prosody is not understood'
    elif name == "say-as":
        kind = attributes.get("interpret-as", "")
        if kind not in CHARACTERS | DIGITS | NUMBERS:
            yield f'interpret-as="{kind[:40]}" of say-as is not understood: its text is spoken as usual'
    elif name == "emphasis" and attributes.get("level", "moderate") not in EMPHASIS:
        yield f'level="{attributes["level"][:40]}" of emphasis is not understood: taken as moderate'


def _point(name: str, attributes: Mapping[str, str], odd: list[str]) -> Iterator[Part]:
    """Yield the mark or the break of an element without content, and add warnings to `odd`."""
    if name == "break":
        time, strength = attributes.get("time"), attributes.get("strength", "medium")
        clock = CLOCK.fullmatch(time or "")
        if clock:
            seconds = float(clock[1]) / (1000 if clock[2] == "ms" else 1)
            if seconds > LONGEST_BREAK:
                odd.append(f"a break of {seconds:g} s is cut to {LONGEST_BREAK:g} s")
        else:
            seconds = STRENGTHS.get(strength, STRENGTHS["medium"])
            if time is not None:
                odd.append(f'time="{time[:40]}" of break is not understood')
            if strength not in STRENGTHS:
                odd.append(f'strength="{strength[:40]}" of break is not understood')
        yield Break(min(seconds, LONGEST_BREAK))
    else:
        # SSML <mark name>, SAPI <bookmark mark>, BML <sync id>.
        yield Mark(next((attributes[k] for k in ("name", "mark", "id") if k in attributes), ""))


def _scrape(ssml: str) -> Iterator[Part]:
    """Yield text and marks of malformed XML."""
    place = 0
    for tag in MARKUP.finditer(ssml):
        yield unescape(ssml[place : tag.start()], {"&quot;": '"', "&apos;": "'"})
        yield " "
        named = NAMED.match(tag[0])
        if named:
            yield Mark(named[1] if named[1] is not None else named[2])
        place = tag.end()
    yield unescape(ssml[place:].replace("<", " "), {"&quot;": '"', "&apos;": "'"})


def _numbers_in_words(parts: Iterable[Part], language: str) -> Iterator[Part]:
    """Yield the parts with numbers in words of the nearest language."""
    languages, hidden, before = [language], 0, ""
    for part in parts:
        if isinstance(part, Tag):
            hidden += (part.name in AS_GIVEN) * (1 if part.attributes is not None else -1)
            if part.attributes is None:
                languages.pop()
            else:
                languages.append(dict(part.attributes).get("xml:lang", languages[-1]))
        elif isinstance(part, str) and not hidden:
            part = numbers_in_words(part, languages[-1], before)
            before = (before + part)[-80:]
        yield part


def collapsed(parts: list[Part]) -> Iterator[Part]:
    """Yield the parts with adjacent texts joined, blanks collapsed to one space, and no empty text."""
    text = ""
    blank = True  # whether the last text ended in a blank, so that leading blanks are dropped
    for part in [*parts, None]:
        if isinstance(part, str):
            text += part
            continue
        text = re.sub(r"\s+", " ", text)
        if blank:
            text = text.lstrip(" ")
        if text:
            blank = text.endswith(" ")
            yield text
        text = ""
        if part is not None:
            yield part


def write_tag(tag: Tag) -> str:
    if tag.attributes is None:
        return f"</{tag.name}>"
    # quoteattr would choose single quotes for a value with a double one, which engines do not accept.
    pairs = [(key, quoteattr(value.replace('"', " "))) for key, value in tag.attributes]
    return "".join([f"<{tag.name}", *(f" {key}={value}" for key, value in pairs), ">"])
