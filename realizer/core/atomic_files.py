"""Atomic writing: a file appears complete or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """A new file beside `path` that takes its place when the block ends well, and vanishes when it fails.

    A path that exists but is no plain file (a pipe, /dev/null) is written to directly.
    """
    path = Path(path)
    if path.exists() and not path.is_file():
        yield path
        return
    path = path.resolve()  # a link stays a link, its target is replaced
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    draft = Path(name)
    try:
        yield draft
        # mkstemp gives 0600; an existing file keeps its mode, a new one gets the usual one.
        mode = path.stat().st_mode & 0o7777 if path.exists() else 0o666 & ~_umask()
        draft.chmod(mode)
        draft.replace(path)
    except BaseException as error:
        draft.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename is None:  # write errors carry no file name
            error.filename = str(path)
        raise


def write_bytes(path: str | Path, content: bytes) -> None:
    """The whole content, or nothing."""
    with replacing(path) as draft:
        draft.write_bytes(content)


def write_text(path: str | Path, content: str) -> None:
    """Write the whole content as UTF-8 with unchanged line ends, or nothing."""
    write_bytes(path, content.encode("utf-8"))


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
