"""What a `save` message may save: each kind has its folder, its suffix and a check of its content."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from realizer.core.errors import RealizerError
from realizer.protocol.messages.common import Reply
from realizer.protocol.messages.replies import ErrorMessage, Saved
from realizer.server.edits.edit_folder import EditError, EditFolder

if TYPE_CHECKING:
    from realizer.server.session.effects import Write


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
        version = folder.write(
            kind.folder, message.name, suffix=kind.suffix, content=content, version=message.version
        )
    except RealizerError as error:
        code = error.code if isinstance(error, EditError) else "edit"
        # The client knows the file by its place in the folder only.
        words = str(error).replace(f"{order.folder.resolve()}/", "")
        return ErrorMessage(code=code, message=words, where="save")
    place = f"{kind.folder}/{message.name}{kind.suffix}"
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
