"""Atomic writing of files, complete or not at all, and locks on files."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from secrets import token_hex
from typing import IO, Any


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
    draft = path.with_name(f".{path.name}.{token_hex(8)}{path.suffix}")
    draft.touch(exist_ok=False)
    try:
        yield draft
        if path.exists():
            draft.chmod(path.stat().st_mode & 0o7777)
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


def lock(file: IO[Any]) -> bool:
    """Take an exclusive lock on a file until it is closed. Return False if another process holds it."""
    try:
        import fcntl
    except ImportError:  # not POSIX: there are no locks
        return True
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        return False
    return True
