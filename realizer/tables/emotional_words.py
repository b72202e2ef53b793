"""The categories of emotional words (`emotional_words_LANGUAGE.csv`, or a user's file)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from realizer import tables
from realizer.core.errors import TableError

# The eight of Wojdel's appendix D.2, the approval of her 6.5, and what turns the word after it around.
CATEGORIES = (
    "praise", "pleasure", "curiosity", "assent", "sorrow", "fright", "irritation", "disapproval", "approval",
    "negation",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class _Row:
    word: str
    category: str
    origin: str


@dataclass(frozen=True)
class WordList:
    """Words, beginnings of words and phrases, each with its category.

    Attributes:
        phrases: first word -> (the words of a phrase, category), the longest first.
        beginnings: beginning of a word -> category.
    """

    phrases: Mapping[str, tuple[tuple[tuple[str, ...], str], ...]]
    beginnings: Mapping[str, str]

    def categories(self, words: Sequence[str]) -> list[str]:
        """The category of each word, "" for most; of a phrase it is that of all its words.

        A phrase wins over a word, a whole word over a beginning, a longer beginning over a shorter one.
        """
        plain = [word.lower().replace("’", "'") for word in words]
        found = [""] * len(plain)
        at = 0
        while at < len(plain):
            length = 1
            for phrase, category in self.phrases.get(plain[at], ()):
                if tuple(plain[at : at + len(phrase)]) == phrase:
                    length = len(phrase)
                    found[at : at + length] = [category] * length
                    break
            else:
                starts = (plain[at][:end] for end in range(len(plain[at]), 2, -1))
                found[at] = next((self.beginnings[s] for s in starts if s in self.beginnings), "")
            at += length
        return found


@cache
def word_list(language: str) -> WordList | None:
    """Return the words of a language ("en-GB" is "en"), or None if there is no built-in list."""
    subtag = language.replace("_", "-").partition("-")[0].lower()
    if not (subtag.isascii() and subtag.isalpha()):
        return None
    name = f"emotional_words_{subtag}.csv"
    try:
        text = tables.text_of(name)
    except FileNotFoundError:
        return None
    return read_words(text, name)


@cache
def words_of(path: Path) -> WordList:
    """The words of a user's file.

    Raises:
        TableError: an unreadable file, or as `read_words`.
    """
    try:
        return read_words(path.read_text("utf-8-sig"), str(path))
    except (OSError, UnicodeError) as error:
        raise TableError(f"{path}: wanted a list of words, {error}") from None


def read_words(text: str, name: str) -> WordList:
    """Read a list: columns word, category, origin.

    Raises:
        TableError: a bad row, an unknown category, a word twice; with file and word.
    """
    phrases: dict[str, list[tuple[tuple[str, ...], str]]] = {}
    beginnings: dict[str, str] = {}
    seen: set[str] = set()
    for row in tables.read_csv(text, _Row, name):
        word = row.word.strip().lower()
        if row.category not in CATEGORIES:
            raise TableError(f"{name}, {word}: wanted one of {', '.join(CATEGORIES)}, got {row.category!r}")
        if not word.strip("*") or word in seen or not row.origin:
            raise TableError(f"{name}, {word!r}: wanted a word that stands once, with its origin")
        seen.add(word)
        if word.endswith("*"):
            if len(word) < 4 or " " in word:
                raise TableError(f"{name}, {word}: wanted three letters or more and no blank before a star")
            beginnings[word[:-1]] = row.category
        else:
            parts = tuple(word.split())
            phrases.setdefault(parts[0], []).append((parts, row.category))
    ordered = {first: tuple(sorted(some, key=lambda one: -len(one[0]))) for first, some in phrases.items()}
    return WordList(ordered, beginnings)
