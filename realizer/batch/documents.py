"""Named documents from files, folders, patterns and lists."""

from __future__ import annotations

import glob
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from realizer.core.errors import RealizerError

SUFFIXES = (".bml", ".xml")  # of what is taken for a document in a folder


class DocumentsError(RealizerError):
    """A place where no document is, or two documents of one name; the text says which."""


@dataclass(frozen=True, slots=True, order=True)
class Document:
    """A file and what its outputs are called: a path without suffix, with `/` between folders."""

    name: str
    path: Path


def find(places: Iterable[str]) -> list[Document]:
    """The documents of all places, by name; one that several places name is there once.

    What a folder or a pattern (`talks/*/*.bml`, `talks/**/*.bml`) gives is named from there on; a file that
    is named itself, from the current folder on, or by its last part alone where it lies elsewhere. So a
    document's name does not depend on which others are there.

    Raises:
        DocumentsError: a place has no document, or two documents would write the same outputs.
    """
    found: dict[str, Document] = {}
    for place in places:
        empty = True
        for path, base in _files(place):
            empty = False
            document = Document(_name(path, base), path)
            other = found.setdefault(document.name, document)
            if other.path.resolve() != path.resolve():
                raise DocumentsError(
                    f"{path}: wanted documents with names of their own, but {other.path} is "
                    f"{document.name!r} too; name a folder that holds both"
                )
        if empty:
            raise DocumentsError(f"{place}: wanted a document, a folder or a pattern, found nothing there")
    return sorted(found.values())


def _files(place: str) -> Iterator[tuple[Path, Path]]:
    """(file, the folder that its name starts from)."""
    path = Path(place)
    if path.is_dir():
        for file in sorted(p for p in path.rglob("*") if p.suffix.lower() in SUFFIXES and _is_file(p)):
            yield file, path
    elif path.is_file():
        yield path, Path.cwd()
    elif glob.has_magic(place):
        first = next(k for k, part in enumerate(path.parts) if glob.has_magic(part))
        base = Path(*path.parts[:first])
        for file in sorted(p for p in base.glob(str(Path(*path.parts[first:]))) if _is_file(p)):
            yield file, base


def _is_file(path: Path) -> bool:
    """Also a link to one that is gone: it cannot be read, and that is to be told of."""
    return path.is_file() or (path.is_symlink() and not path.exists())


def _name(path: Path, base: Path) -> str:
    inside = path.absolute()
    start = base.absolute()
    relative = inside.relative_to(start) if inside.is_relative_to(start) else Path(path.name)
    return relative.with_suffix("").as_posix()
