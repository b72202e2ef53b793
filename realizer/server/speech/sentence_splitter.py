"""An incremental splitter of tagged text into sentences."""

import re
from functools import cache
from typing import Any

from realizer import tables
from realizer.speech.ssml import EMPTY
from realizer.text.parts import ANY_TAG as TAG

VALUE = r"(?:\"[^\"]*\"|'[^']*'|[^\s\"'<>/]+)"
BEGUN = re.compile(  # an incomplete tag
    rf"</?(?:[A-Za-z_][\w.:-]*(?:\s+[\w.:-]+\s*=\s*{VALUE})*+"
    r"\s*(?:/|[\w.:-]+\s*(?:=\s*(?:\"[^\"]*|'[^']*|[^\s\"'<>/]*))?)?)?$"
)
ENTITY = re.compile(r"&#?\w{1,10}$")  # an entity without its semicolon
CONTENTLESS = frozenset({*EMPTY, "br"})  # elements whose end tag no text waits for; "br" of HTML is common
MAX_TAG = 2000  # characters; longer text after "<" is not a tag
MAX_TEXT = 20_000  # characters; longer text does not wait for an end tag


class SentenceSplitter:
    """A splitter that is fed text in chunks and returns sentences and clauses as they become complete."""

    def __init__(self) -> None:
        self._rest = ""
        self._first = True

    def feed(self, text: str, *, close: bool = False) -> list[str]:
        """Add text and return the pieces that are complete.

        A sentence is complete when white space follows it; tags directly behind it belong to it. A long
        sentence, and a first one that is not short, is split into clauses. Elements are never split.

        Args:
            close: whether this is the end of the text: then the rest is returned too.

        Returns:
            Pieces in order; together they are the text.
        """
        self._rest += text
        pieces: list[str] = []
        while (end := _end(self._rest, first=self._first, closed=close)) is not None:
            pieces.append(self._rest[:end])
            self._rest, self._first = self._rest[end:], False
        if close or len(self._rest) > MAX_TEXT:
            pieces.append(self._rest)
            self._rest = ""
        return [piece for piece in pieces if piece.strip()]


def is_sentence(piece: str) -> bool:
    """Return whether a piece ends like a sentence."""
    text = TAG.sub("", piece).rstrip()
    return bool(_ending().search(text)) and not _abbreviated(text)


def _end(text: str, *, first: bool, closed: bool) -> int | None:
    """Return the length of the first piece of a text; None while it is incomplete."""
    rules = _rules()
    limit = rules["first"] if first else rules["longest"]
    at = depth = length = 0
    blank: int | None = None  # end of the last white space outside of elements
    ended = False  # whether a sentence ends here
    while at < len(text):
        if text[at] == "<":
            tag = TAG.match(text, at)
            if tag is not None:
                if tag[2].rpartition(":")[2] not in CONTENTLESS:
                    depth = max(0, depth + (-1 if tag[1] else 0 if tag[4] else 1))
                at = tag.end()
                continue
            if not closed and BEGUN.match(text[at : at + MAX_TAG]):
                return None
            # A plain "<" is handled like any character.
        end = text.find("<", at + 1)
        end = len(text) if end < 0 else end
        run = text[at:end]
        if depth == 0:
            if ended and run[0].isspace():
                return at
            for sign in _signs().finditer(run):
                kind, stop = sign.lastgroup, sign.end()
                follows = run[stop : stop + 1]
                if kind == "sentence" and _abbreviated(text[:at] + run[:stop]):
                    continue
                if sign[0][0] == ";" and ENTITY.search(run[: sign.start()]):
                    continue
                if not follows and kind == "sentence" and end < len(text):
                    break  # a tag follows directly: decide behind it
                if not (follows.isspace() or sign[0][-1] in rules["alone"] + rules["wide"]):
                    continue
                if kind == "sentence" or length + stop >= limit:
                    return at + stop
            spaces = [found.end() for found in re.finditer(r"\s", run)]
            blank = at + spaces[-1] if spaces else blank
            ended = bool(_ending().search(run)) and not _abbreviated(text[:end])
            if (paragraph := re.search(r"\n\s*\n", run)) and text[: at + paragraph.start()].strip():
                return at + paragraph.end()
            if blank is not None and length + len(run) > rules["most"]:
                return blank
        length += len(run)
        at = end
    return None


def _abbreviated(text: str) -> bool:
    """Return whether the final full stop belongs to an abbreviation, an initial or a list number."""
    match = re.search(r"([^\W_][\w.]*)\.$", text)
    if match is None:
        return False
    word = match[1].lower()
    if word.isdigit():
        return not TAG.sub("", text[: match.start()]).strip()
    return word in _rules()["abbreviations"] or (len(word) == 1 and word.isalpha())


@cache
def _signs() -> re.Pattern[str]:
    signs, marks, closing = (re.escape(_rules()[name]) for name in ("signs", "marks", "closing"))
    return re.compile(f"(?P<sentence>[{signs}]+[{closing}]*)|(?P<clause>[{marks}][{closing}]*)")


@cache
def _ending() -> re.Pattern[str]:
    signs, closing = (re.escape(_rules()[name]) for name in ("signs", "closing"))
    return re.compile(f"[{signs}][{closing}]*$")


@cache
def _rules() -> dict[str, Any]:
    return tables.read_toml(tables.text_of("clauses.toml"), "clauses.toml")
