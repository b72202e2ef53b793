"""The library of expressions by name: templates, lexemes and a user's folder; and their search words."""

import logging
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, lru_cache, partial
from pathlib import Path

import numpy as np

from realizer import tables
from realizer.core.errors import TableError
from realizer.core.similar import did_you_mean, similar
from realizer.expressions.expression import Expression, key
from realizer.tables.lexemes import face_lexemes
from realizer.tables.templates import PREFIX, Template, apex, templates
from realizer.tables.timing import Gap, gaps

log = logging.getLogger(__name__)


@dataclass(frozen=True, slots=True)
class ExpressionWords:
    """Words of an expression; templates have their `features` in their own table."""

    name: str
    features: str
    means: str

    @property
    def words(self) -> tuple[str, ...]:
        """Return the words and phrases of `means`."""
        return tuple(word.strip() for word in self.means.split(";") if word.strip())


# () -> {name in the expression library: words}
expression_words = cache(partial(tables.csv_index, "expression_words.csv", ExpressionWords, "name"))


class Library(Mapping[str, Expression]):
    """Expressions by name, in any spelling; a later expression replaces one of the same name.

    Attributes:
        notes: messages about replaced expressions.
        edition: increases whenever the expressions are replaced.
    """

    edition = 0

    def __init__(self, expressions: Iterable[Expression]) -> None:
        self.replace(expressions)

    def replace(self, expressions: Iterable[Expression]) -> None:
        """Replace all expressions."""
        known: dict[str, Expression] = {}
        notes = []
        for expression in expressions:
            replaced = known.get(key(expression.name))
            if replaced is not None:
                notes.append(f"{expression.file}: {expression.name} replaces the built-in {replaced.name}")
            known[key(expression.name)] = expression
        self.notes = tuple(notes)
        self.edition += 1
        self._known, self._as_written = known, {expression.name: expression for expression in known.values()}

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
        found = similar(key(name), parts)
        return list(dict.fromkeys(name for part in found for name in parts[part]))[:3]

    def unknown(self, name: str) -> str:
        """Return the error message for an unknown name."""
        hint = did_you_mean(self.near(name))
        return f"wanted a name of `realizer expressions list`, got {name[:60]!r}{hint}"


@cache
def builtin() -> Library:
    """Return the face lexemes, and the templates of Wojdel as "template:..."."""
    return Library([*map(_of_lexeme, face_lexemes()), *map(_of_template, templates().values())])


def library_of(folder: Path | None = None) -> Library:
    """Return the built-in expressions, replaced and extended by those of a user's folder.

    The folder is read again when its files have changed; who has its library has the new expressions then. If
    they cannot be read, the library stays as it is, and the log says why.

    Raises:
        TableError: invalid files; the text has a line for each fault, with file and key.
    """
    if folder is None:
        return builtin()
    own = _own(folder.resolve())
    own.refresh()
    return own.library


class _OwnLibrary:
    """The library of a user's folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._files = self._stamp()
        self.library = Library(self._expressions())
        for note in self.library.notes:
            log.warning(note)
        if len(self.library) == len(builtin()) and not self.library.notes and folder.exists():
            log.warning("%s: wanted expressions, one .toml file each, found none", folder)

    def refresh(self) -> None:
        """Read the folder again if a file of it has changed."""
        if (files := self._stamp()) == self._files:
            return
        self._files = files
        try:
            self.library.replace(self._expressions())
        except TableError as error:
            log.warning("expressions stay as they were: %s", error)

    def _expressions(self) -> list[Expression]:
        from realizer.expressions.user_expressions import read_folder

        return [*builtin().values(), *read_folder(self._folder)]

    def _stamp(self) -> dict[str, tuple[int, int]]:
        """Return the time of the last change and the size of each file."""
        found = ((path.name, path.stat()) for path in self._folder.glob("*.toml") if path.exists())
        return {name: (stat.st_mtime_ns, stat.st_size) for name, stat in found}


_own = lru_cache(maxsize=16)(_OwnLibrary)


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
