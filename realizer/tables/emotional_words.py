"""The categories of emotional words (`emotional_words_LANGUAGE.csv`, or a user's file)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from realizer import tables
from realizer.core.errors import TableError

# The eight categories of Wojdel 2005, appendix D.2, approval (6.5), and negations of the words after them.
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
    """Words, phrases and beginnings of words, with their categories."""

    # First word -> (words, category) of each phrase, the longest first.
    phrases: Mapping[str, tuple[tuple[tuple[str, ...], str], ...]]
    beginnings: Mapping[str, str]  # beginning of a word -> category

    def categories(self, words: Sequence[str]) -> list[str]:
        """Return the category of each word, or ""; all words of a phrase have the category of the phrase.

        Phrases have priority over words, words over beginnings, and long beginnings over short ones.
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
    """Return the built-in list of a language ("en-GB" is "en"), or None."""
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
    """Return the list of a user's file; raises FileNotFoundError, and TableError as `read_words`."""
    try:
        return read_words(path.read_text("utf-8-sig"), str(path))
    except FileNotFoundError:
        raise
    except (OSError, UnicodeError) as error:
        raise TableError(f"{path}: wanted a list of words, {error}") from None


def read_words(text: str, name: str) -> WordList:
    """Parse a list with the columns word, category and origin; raises TableError, with file and word."""
    phrases: dict[str, list[tuple[tuple[str, ...], str]]] = {}
    beginnings: dict[str, str] = {}
    seen: set[str] = set()
    for row in tables.read_csv(text, _Row, name):
        word = row.word.strip().lower()
        if row.category not in CATEGORIES:
            raise TableError(f"{name}, {word}: wanted one of {', '.join(CATEGORIES)}, got {row.category!r}")
        if not word.strip("*") or word in seen or not row.origin:
            raise TableError(f"{name}, {word!r}: wanted each word once, with its origin")
        seen.add(word)
        if word.endswith("*"):
            if len(word) < 4 or " " in word:
                raise TableError(f"{name}, {word}: wanted three letters or more and no blank before a star")
            beginnings[word[:-1]] = row.category
        else:
            parts = tuple(word.split())
            phrases.setdefault(parts[0], []).append((parts, row.category))
    ordered = {
        first: tuple(sorted(known, key=lambda phrase: len(phrase[0]), reverse=True))
        for first, known in phrases.items()
    }
    return WordList(ordered, beginnings)
