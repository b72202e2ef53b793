"""Atomic writing of files: complete or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def replacing(path: str | Path) -> Iterator[Path]:
    """Yield a new file that replaces `path` at the end of the block, or is deleted if the block fails.

    A path that exists but is not a regular file (a pipe, /dev/null) is yielded itself.
    """
    path = Path(path)
    if path.exists() and not path.is_file():
        yield path
        return
    path = path.resolve()  # replaces the target of a link, not the link
    handle, name = tempfile.mkstemp(prefix=f".{path.name}.", suffix=path.suffix, dir=path.parent)
    os.close(handle)
    draft = Path(name)
    try:
        yield draft
        # mkstemp creates files with mode 0600.
        mode = path.stat().st_mode & 0o7777 if path.exists() else 0o666 & ~_umask()
        draft.chmod(mode)
        draft.replace(path)
    except BaseException as error:
        draft.unlink(missing_ok=True)
        if isinstance(error, OSError) and error.filename is None:  # write errors carry no file name
            error.filename = str(path)
        raise


def write_bytes(path: str | Path, content: bytes) -> None:
    """Write a whole file, or nothing."""
    with replacing(path) as draft:
        draft.write_bytes(content)


def write_text(path: str | Path, content: str) -> None:
    """Write a whole file as UTF-8 with unchanged line ends, or nothing."""
    write_bytes(path, content.encode("utf-8"))


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask
