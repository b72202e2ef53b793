"""The library of expressions by name: templates, lexemes and a user's folder."""

from __future__ import annotations

import difflib
import logging
from collections.abc import Iterable, Iterator, Mapping
from functools import cache, lru_cache
from pathlib import Path

import numpy as np

from realizer.expressions.expression import Expression, key
from realizer.tables.expression_words import expression_words
from realizer.tables.lexemes import face_lexemes
from realizer.tables.templates import Template, apex, templates
from realizer.tables.timing import Gap, gaps

PREFIX = "template:"
log = logging.getLogger(__name__)


class Library(Mapping[str, Expression]):
    """Expressions by name, however it is spelt; of two with one name the later counts.

    Attributes:
        notes: which took the place of which.
    """

    def __init__(self, expressions: Iterable[Expression]) -> None:
        self._known: dict[str, Expression] = {}
        notes = []
        for one in expressions:
            before = self._known.get(key(one.name))
            if before is not None:
                notes.append(f"{one.file}: {one.name} takes the place of the shipped {before.name}")
            self._known[key(one.name)] = one
        self.notes = tuple(notes)
        self._as_written = {one.name: one for one in self._known.values()}

    def __getitem__(self, name: str) -> Expression:
        # Nearly always the exact spelling.
        return self._as_written.get(name) or self._known[key(name)]

    def __iter__(self) -> Iterator[str]:
        return (one.name for one in self._known.values())

    def __len__(self) -> int:
        return len(self._known)

    def near(self, name: str) -> list[str]:
        """Names that are nearly this one, the nearest first; at most three."""
        parts: dict[str, list[str]] = {}
        for spelt, one in self._known.items():
            for part in {spelt, spelt.rpartition(":")[2]}:
                parts.setdefault(part, []).append(one.name)
        found = difflib.get_close_matches(key(name)[:100], parts, n=3)
        return list(dict.fromkeys(name for part in found for name in parts[part]))[:3]

    def unknown(self, name: str) -> str:
        """Return the message for an unknown name."""
        near = self.near(name)
        hint = f", did you mean {' or '.join(near)}?" if near else ""
        return f"wanted a name of `realizer expressions list`, got {name[:60]!r}{hint}"


@cache
def builtin() -> Library:
    """The twelve templates of Wojdel, as "template:...", and every face lexeme.

    Raises:
        TableError: one of their tables is damaged.
    """
    return Library([*map(_of_lexeme, face_lexemes()), *map(_of_template, templates().values())])


def library_of(folder: Path | None = None) -> Library:
    """Return the library: a user's expressions before the built-in ones. A folder is read once.

    Raises:
        TableError: files that are no expressions; every fault, with file and key.
    """
    return builtin() if folder is None else _with_own(folder.resolve())


@lru_cache(maxsize=16)
def _with_own(folder: Path) -> Library:
    from realizer.expressions.user_expressions import read_folder

    own = read_folder(folder)
    library = Library([*builtin().values(), *own])
    for note in library.notes:
        log.warning(note)
    if not own:
        log.warning("%s: wanted expressions, a .toml file each, found none", folder)
    return library


def _of_lexeme(name: str) -> Expression:
    words = expression_words()[name]
    onset, apex, offset = gaps("faceLexeme", name).gaps
    return Expression(
        name,
        words.features,
        words.words,
        face_lexemes()[name].aus,
        (onset, apex, offset),
        source="faceLexeme of BML, or a word in common use; action units and intensities: lexemes.toml",
    )


def _of_template(template: Template) -> Expression:
    """Return the apex: the average within its probable range, less half of onset and offset."""
    onset, hold, offset = gaps("face").gaps
    evident = template.evident
    if template.probable is not None:
        evident = float(np.clip(evident, *template.probable))
    stiffness = hold.stiffness if template.deviation is None else template.deviation**-2
    name = PREFIX + template.name.lower()
    return Expression(
        name,
        template.features,
        expression_words()[name].words,
        template.aus,
        (onset, Gap("hold", apex(evident), 0.0, stiffness, "Wojdel 2005 tables 6.4 and 6.15"), offset),
        template.possible,
        template.probable,
        "Wojdel 2005 table 6.2; action units ours, from its words",
    )
