"""Named documents from files, folders, patterns and lists."""

import glob
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from realizer.core.errors import RealizerError

SUFFIXES = (".bml", ".xml")  # of documents in a folder


class DocumentsError(RealizerError):
    """A place has no document, or two documents have the same name."""


@dataclass(frozen=True, slots=True, order=True)
class Document:
    """A document file, and the name of its outputs: a path without suffix, with `/` between folders."""

    name: str
    path: Path


def find(places: Iterable[str]) -> list[Document]:
    """Return the documents of all places by name, each once.

    Names are relative to the given folder, or to the folder before a pattern such as `talks/**/*.bml`. Names
    of single files are relative to the current folder, or only the file's name if the file is elsewhere.
    Therefore the name of a document does not depend on other documents.

    Raises:
        DocumentsError: a place has no document, or two documents would write the same outputs.
    """
    documents: dict[str, Document] = {}
    for place in places:
        files = _files(place) if place else []
        if not files:
            raise DocumentsError(
                f"{place or repr(place)}: wanted a document, a folder or a pattern, found nothing there"
            )
        for path, base in files:
            document = Document(_name(path, base), path)
            other = documents.setdefault(document.name, document)
            if other.path.resolve() != path.resolve():
                raise DocumentsError(
                    f"{path}: wanted documents with different names, but {other.path} is "
                    f"{document.name!r} too; name a folder that holds both"
                )
    return sorted(documents.values())


def _files(place: str) -> list[tuple[Path, Path]]:
    """Return (file, the folder that its name is relative to)."""
    path = Path(place)
    if path.is_file():
        return [(path, Path.cwd())]
    if path.is_dir():
        base, files = path, [p for p in path.rglob("*") if p.suffix.lower() in SUFFIXES]
    elif glob.has_magic(place):
        first = next(k for k, part in enumerate(path.parts) if glob.has_magic(part))
        base = Path(*path.parts[:first])
        files = list(base.glob(str(Path(*path.parts[first:]))))
    else:
        return []
    # Broken links are included, so that their failure is reported.
    return [(p, base) for p in sorted(files) if p.is_file() or (p.is_symlink() and not p.exists())]


def _name(path: Path, base: Path) -> str:
    path, base = path.absolute(), base.absolute()
    relative = path.relative_to(base) if path.is_relative_to(base) else Path(path.name)
    return relative.with_suffix("").as_posix()
