"""The folder in which clients save files: which kinds, whole, and never over somebody else's change."""

from __future__ import annotations

import base64
import binascii
import hashlib
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from realizer.core.atomic_files import lock, write_bytes
from realizer.core.errors import RealizerError
from realizer.protocol.messages.common import Reply
from realizer.protocol.messages.replies import ErrorCode, ErrorMessage, Saved

if TYPE_CHECKING:
    from realizer.server.session.effects import Write


NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,63}")
LOCK = ".lock"


class EditError(RealizerError):
    """A file that is not saved; nothing has changed."""

    def __init__(self, text: str, code: ErrorCode = "edit") -> None:
        super().__init__(text)
        self.code: ErrorCode = code


def version_of(content: bytes) -> str:
    """Return the version of a file with that content."""
    return hashlib.sha256(content).hexdigest()[:16]


class EditFolder:
    """A folder in which clients save files."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder.resolve()

    def path(self, *names: str, suffix: str) -> Path:
        """Return the path of a file: `names` are folders below this one and the file's name without suffix.

        Raises:
            EditError: a name that could lead elsewhere.
        """
        for name in names:
            if not NAME.fullmatch(name):
                raise EditError(f"name: wanted a-z, 0-9, - and _, up to 64 of them, got {name[:80]!r}")
        path = self._folder.joinpath(*names).with_suffix(suffix)
        if not path.resolve().is_relative_to(self._folder):
            raise EditError(f"{'/'.join(names)}{suffix}: wanted a file of this folder, got a link to another")
        return path

    def write(self, path: Path, content: bytes, version: str | None) -> str:
        """Write a file, complete or not at all, and return its new version.

        Args:
            path: as `path` returns it.
            version: of the file that this replaces; None: there is none.

        Raises:
            EditError: the file has changed since `version`, or it cannot be written.
        """
        place = path.relative_to(self._folder)
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            # Another process of the service may save as well.
            with (self._folder / LOCK).open("a") as guard:
                if not lock(guard):
                    raise EditError(f"{place}: another process saves just now: try again")
                present = version_of(path.read_bytes()) if path.exists() else None
                if present != version:
                    raise EditError(f"{place}: {_conflict(present, version)}", "conflict")
                write_bytes(path, content)
        except OSError as error:
            raise EditError(f"{place}: cannot be saved: {error.strerror or error}") from None
        return version_of(content)


def _conflict(present: str | None, version: str | None) -> str:
    if present is None:
        return "wanted the file that was opened, but it is gone: save it as a new one"
    if version is None:
        return "wanted a new name, as there is such a file"
    return "it was changed since it was opened: open it again, or save as another name"


class Kind(NamedTuple):
    """A kind of file: `check` takes its path and content, and raises RealizerError if it cannot be used."""

    folder: str
    suffix: str
    check: Callable[[Path, bytes], None]


def save(order: Write) -> Reply:
    """Save a file, and return the answer."""
    message = order.message
    kind = KINDS[message.kind]
    folder = EditFolder(order.folder)
    try:
        content = _content(message.content, message.encoding)
        path = folder.path(kind.folder, message.name, suffix=kind.suffix)
        kind.check(path, content)
        version = folder.write(path, content, message.version)
    except RealizerError as error:
        code = error.code if isinstance(error, EditError) else "edit"
        # The client knows the file by its place in the folder only.
        words = str(error).replace(f"{order.folder.resolve()}/", "")
        return ErrorMessage(code=code, message=words, where="save")
    place = path.relative_to(order.folder.resolve()).as_posix()
    return Saved(kind=message.kind, name=message.name, version=version, file=place)


def _content(text: str, encoding: str) -> bytes:
    if encoding == "text":
        return text.encode()
    try:
        return base64.b64decode(text, validate=True)
    except (binascii.Error, ValueError):
        raise EditError("content: wanted base64") from None


def _check_expression(path: Path, content: bytes) -> None:
    from realizer.expressions.user_expressions import check_file

    check_file(path, content)


KINDS = {"expression": Kind("expressions", ".toml", _check_expression)}
