"""The batch run: plays documents and writes their outputs and the manifest."""

from collections.abc import Iterable, Iterator
from itertools import chain
from pathlib import Path

from realizer.batch.dask_cluster import DaskCluster
from realizer.batch.documents import Document
from realizer.batch.manifest import Manifest, Row
from realizer.batch.process_pool import ProcessPool
from realizer.batch.task import Options, Task, fingerprint, key_of
from realizer.batch.worker import Outcome, failure
from realizer.core.atomic_files import write_bytes


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
