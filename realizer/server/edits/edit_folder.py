"""The folder in which clients save files: whole files, and never over somebody else's change."""

from __future__ import annotations

import hashlib
import re
from pathlib import Path

from realizer.core.atomic_files import lock, write_bytes
from realizer.core.errors import RealizerError
from realizer.protocol.messages.replies import ErrorCode

NAME = re.compile(r"[a-z0-9][a-z0-9_-]{0,63}")
SUFFIX = re.compile(r"\.[a-z0-9]{1,8}")
MAX_FILE = 64 * 2**20  # bytes
LOCK = ".lock"


class EditError(RealizerError):
    """A file that is not saved; nothing has changed.

    Attributes:
        code: of the error message for the client.
    """

    def __init__(self, text: str, code: ErrorCode = "edit") -> None:
        super().__init__(text)
        self.code: ErrorCode = code


def version_of(content: bytes) -> str:
    """Return the version of a file with that content."""
    return hashlib.sha256(content).hexdigest()[:16]


class EditFolder:
    """A folder in which clients save files.

    Args:
        folder: exists, and can be written to.
    """

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
        if not names or not SUFFIX.fullmatch(suffix):
            raise EditError(f"name: wanted a name and a suffix such as .toml, got {suffix[:80]!r}")
        path = self._folder.joinpath(*names).with_suffix(suffix)
        if not path.resolve().is_relative_to(self._folder):
            raise EditError(f"{'/'.join(names)}{suffix}: wanted a file of this folder, got a link to another")
        return path

    def write(self, *names: str, suffix: str, content: bytes, version: str | None) -> str:
        """Write a file, complete or not at all, and return its new version.

        Args:
            names, suffix: as for `path`; folders are made.
            version: of the file that this replaces; None: there is none.

        Raises:
            EditError: a wrong name; too much; the file has changed since `version`; or it cannot be written.
        """
        path = self.path(*names, suffix=suffix)
        place = path.relative_to(self._folder)
        if len(content) > MAX_FILE:
            raise EditError(f"{place}: wanted at most {MAX_FILE} bytes, got {len(content)}")
        try:
            path.parent.mkdir(parents=True, exist_ok=True)
            # Another process of the service may save as well.
            with (self._folder / LOCK).open("a") as guard:
                if not lock(guard):
                    raise EditError(f"{place}: another process saves just now: try again")
                self._check(path, version)
                write_bytes(path, content)
        except OSError as error:
            raise EditError(f"{place}: cannot be saved: {error.strerror or error}") from None
        return version_of(content)

    def _check(self, path: Path, version: str | None) -> None:
        """Raise EditError if a file is not of the expected version."""
        place = path.relative_to(self._folder)
        present = version_of(path.read_bytes()) if path.exists() else None
        if present == version:
            return
        if present is None:
            words = f"{place}: wanted the file that was opened, but it is gone: save it as a new one"
        elif version is None:
            words = f"{place}: wanted a new name, as there is such a file"
        else:
            words = f"{place}: it was changed since it was opened: open it again, or save as another name"
        raise EditError(words, "conflict")
