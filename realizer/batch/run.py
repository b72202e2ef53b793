"""The batch run: documents to outputs and a manifest."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path
from typing import Protocol

from realizer.batch.documents import Document
from realizer.batch.manifest import Manifest, Row
from realizer.batch.task import Options, Task, fingerprint, key_of
from realizer.batch.worker import Outcome, failure
from realizer.core.atomic_files import write_bytes


class Workers(Protocol):
    """Whoever plays documents: `ProcessPool` or a `DaskCluster`."""

    def perform(self, tasks: Iterable[Task]) -> Iterator[Outcome]:
        """The outcome of each task, in any order."""
        ...

    def close(self) -> None:
        """Let go of the workers."""
        ...


def batch(
    documents: Iterable[Document], folder: Path, options: Options, workers: Workers
) -> Iterator[tuple[Row, bool]]:
    """Play what was not played yet; (row of the manifest, whether it was there already) for each document.

    What comes of a document is written first and told of in the manifest then: a crash in between costs that
    document's time and nothing else.

    Raises:
        BusyError: another batch writes to that folder.
        FaceError: no such face.
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
    """The documents as tasks, read as they are wanted; what cannot be read is one more that failed."""
    for document in documents:
        try:
            text = document.path.read_bytes()
        except OSError as error:
            words = f"{document.path}: {error.strerror}"
            unread.append(failure(Task(document.name, "", b"", mark), words))
        else:
            yield Task(document.name, key_of(text, mark), text, mark)
