"""Parts of a text that is spoken: words, and tags between them."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

# A tag; groups: "/" of an end tag, name, attributes, "/" of an empty element.
ANY_TAG = re.compile(r"<(/?)([A-Za-z_][\w.-]*(?::[\w.-]+)?)((?:[^<>\"']|\"[^\"]*\"|'[^']*')*?)(/?)>")
VALUE = r"(?:\"[^\"<]*\"|'[^'<]*'|[^\s\"'<>=/]+)"
# A tag of XML: a "<" before anything else is a sign of the text.
TAG = re.compile(rf"</?[A-Za-z_][\w.-]*(?::[\w.-]+)?(?:\s+[\w:.-]+\s*=\s*{VALUE})*\s*/?>")
BEGUN = re.compile(  # a tag whose end is missing
    rf"<(?:!(?:-(?:-.*)?)?|/?(?:[A-Za-z_][\w.:-]*(?:\s+[\w.:-]+\s*=\s*{VALUE})*+"
    r"(?:\s+[\w.:-]*(?:\s*=\s*(?:\"[^\"<]*|'[^'<]*)?)?)?\s*/?)?)$",
    re.DOTALL,
)
_BLANKS = re.compile(r"\s{2,}|[^\S ]")
_BEFORE_SIGN = re.compile(r"[ \n]+([.,;!?](?![\w.]))")
_WORD_END = re.compile(r"[\w.,;:!?…]\w")  # words that only a behaviour keeps apart
_ESCAPES = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;"})


@dataclass(frozen=True, slots=True)
class Tag:
    """A tag or an element of SSML or BML; `shows` tells a behaviour from markup of the words."""

    source: str
    shows: bool = False


Part = str | Tag


def markup(parts: Iterable[Part]) -> str:
    """Return parts as text with tags, in which "&", "<" and ">" of the words are escaped."""
    return "".join(part.translate(_ESCAPES) if isinstance(part, str) else part.source for part in parts)


def joined(parts: Iterable[Part]) -> list[Part]:
    """Return parts without empty words, and with adjacent words joined."""
    found: list[Part] = []
    for part in parts:
        if isinstance(part, str) and found and isinstance(last := found[-1], str):
            found[-1] = last + part
        elif part:
            found.append(part)
    return found


def tidy(parts: Iterable[Part]) -> list[Part]:
    """Return parts with single blanks, none at the ends and none before punctuation; empty lines stay."""
    found: list[Part] = []
    end = "\n"  # of the words so far
    for part in joined(parts):
        if isinstance(part, str):
            part = _BEFORE_SIGN.sub(r"\1", _BLANKS.sub(_single, part))
            part = part.lstrip() if end.isspace() else part
            if found and isinstance(last := found[-1], Tag) and last.shows and _WORD_END.match(end + part):
                part = f" {part}"
            if part and part[0] in ".,;:!?" and end == " ":
                place = max(k for k, one in enumerate(found) if isinstance(one, str))
                found[place] = str(found[place]).rstrip(" ")
            end = part[-1:] or end
        if part:
            found.append(part)
    for place in range(len(found) - 1, -1, -1):  # the last words, before behaviours at the end
        if isinstance(last := found[place], str):
            found[place] = last.rstrip()
            break
    return joined(found)


def _single(blanks: re.Match[str]) -> str:
    lines = blanks[0].count("\n")
    return "\n\n" if lines > 1 else "\n" if lines else " "
