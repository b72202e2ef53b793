"""The library of expressions by name: templates, lexemes and a user's folder."""

import difflib
import logging
from collections.abc import Iterable, Iterator, Mapping
from functools import cache, lru_cache
from pathlib import Path

import numpy as np

from realizer.expressions.expression import Expression, key
from realizer.tables.expression_words import expression_words
from realizer.tables.lexemes import face_lexemes
from realizer.tables.templates import PREFIX, Template, apex, templates
from realizer.tables.timing import Gap, gaps

log = logging.getLogger(__name__)


class Library(Mapping[str, Expression]):
    """Expressions by name, in any spelling; a later expression replaces one of the same name.

    Attributes:
        notes: messages about replaced expressions.
    """

    def __init__(self, expressions: Iterable[Expression]) -> None:
        self._known: dict[str, Expression] = {}
        notes = []
        for expression in expressions:
            replaced = self._known.get(key(expression.name))
            if replaced is not None:
                notes.append(f"{expression.file}: {expression.name} replaces the built-in {replaced.name}")
            self._known[key(expression.name)] = expression
        self.notes = tuple(notes)
        self._as_written = {expression.name: expression for expression in self._known.values()}

    def __getitem__(self, name: str) -> Expression:
        # Spellings are nearly always exact.
        return self._as_written.get(name) or self._known[key(name)]

    def __iter__(self) -> Iterator[str]:
        return iter(self._as_written)

    def __len__(self) -> int:
        return len(self._known)

    def near(self, name: str) -> list[str]:
        """Return up to three similar names, the most similar first."""
        parts: dict[str, list[str]] = {}
        for spelling, expression in self._known.items():
            for part in {spelling, spelling.rpartition(":")[2]}:
                parts.setdefault(part, []).append(expression.name)
        found = difflib.get_close_matches(key(name)[:100], parts, n=3)
        return list(dict.fromkeys(name for part in found for name in parts[part]))[:3]

    def unknown(self, name: str) -> str:
        """Return the error message for an unknown name."""
        near = self.near(name)
        hint = f", did you mean {' or '.join(near)}?" if near else ""
        return f"wanted a name of `realizer expressions list`, got {name[:60]!r}{hint}"


@cache
def builtin() -> Library:
    """Return the face lexemes, and the templates of Wojdel as "template:..."."""
    return Library([*map(_of_lexeme, face_lexemes()), *map(_of_template, templates().values())])


def library_of(folder: Path | None = None) -> Library:
    """Return the built-in expressions, replaced and extended by those of a user's folder, which is read once.

    Raises:
        TableError: invalid files; the text has a line for each fault, with file and key.
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
        log.warning("%s: wanted expressions, one .toml file each, found none", folder)
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
    """Return the expression of a template; its visible time is the average, within the probable range."""
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
