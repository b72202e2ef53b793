"""The batch run: plays documents and writes their outputs and the manifest."""

import glob
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path

from realizer.core.atomic_files import write_bytes
from realizer.core.errors import RealizerError
from realizer_studio.batch.dask_cluster import DaskCluster
from realizer_studio.batch.manifest import Manifest, Row
from realizer_studio.batch.process_pool import ProcessPool
from realizer_studio.batch.task import Options, Task, fingerprint, key_of
from realizer_studio.batch.worker import Outcome, failure

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


def batch(
    documents: Iterable[Document], folder: Path, options: Options, workers: ProcessPool | DaskCluster
) -> Iterator[tuple[Row, bool]]:
    """Play the documents that have no valid outputs yet. Yield (row of the manifest, whether it was skipped).

    The outputs of a document are written before its row, so that a crash in between only costs the time to
    play it again.

    Raises:
        BusyError: another batch writes to that folder.
        FaceError: there is no such face.
        OSError: an output cannot be written.
    """
    mark = fingerprint(options)
    with Manifest(folder).open() as manifest:
        left: list[Document] = []
        unread: list[Outcome] = []
        for document in documents:
            for task in _tasks([document], mark, unread):
                row = manifest.is_done(task.name, task.key)
                if row is None:
                    left.append(document)
                else:
                    yield row, True
        for outcome in chain(workers.perform(_tasks(left, mark, unread)), unread):
            for name, content in outcome.files.items():
                path = folder / name
                path.parent.mkdir(parents=True, exist_ok=True)
                write_bytes(path, content)
            manifest.add(outcome.row)
            yield outcome.row, False


def _tasks(documents: Iterable[Document], mark: str, unread: list[Outcome]) -> Iterator[Task]:
    """Yield the documents as tasks, reading them lazily; add those that cannot be read to `unread`."""
    for document in documents:
        try:
            text = document.path.read_bytes()
        except OSError as error:
            words = f"{document.path}: {error.strerror}"
            unread.append(failure(Task(document.name, "", b"", mark), words))
        else:
            yield Task(document.name, key_of(text, mark), text, mark)
