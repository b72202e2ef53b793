"""Messages of a page and its tools: JSON, or JSON with arrays or bytes behind it."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

from realizer.core.errors import RealizerError

ALIGN = 8  # bytes; arrays begin at a multiple of it


def packed(header: Mapping[str, Any], arrays: Mapping[str, Any]) -> bytes:
    """Return JSON and arrays as one message: the length of the JSON (u32), the JSON, and the arrays.

    `arrays` of the JSON has the name, the type as numpy's and the offset from the message's start of each.
    """
    rows = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    listed = {name: [array.dtype.str[1:], array.size, 0] for name, array in rows.items()}
    room = len(json.dumps({**header, "arrays": listed})) + 12 * len(rows) + 4
    at = -(-room // ALIGN) * ALIGN
    start = at
    for name, array in rows.items():
        listed[name][2] = at
        at += -(-array.nbytes // ALIGN) * ALIGN
    text = json.dumps({**header, "arrays": listed}).ljust(start - 4).encode()
    parts: list[bytes | memoryview] = [len(text).to_bytes(4, "little"), text]
    for array in rows.values():
        parts += array.reshape(-1).view(np.uint8).data, bytes(-array.nbytes % ALIGN)
    return b"".join(parts)


def unpacked(message: str | bytes) -> tuple[dict[str, Any], bytes]:
    """Return the JSON of a message of the page, and the bytes behind it.

    Raises:
        RealizerError: it is no such message.
    """
    try:
        if isinstance(message, str):
            asked, payload = json.loads(message), b""
        else:
            (length,) = struct.unpack_from("<I", message)
            asked, payload = json.loads(message[4 : 4 + length]), message[4 + length :]
    except (ValueError, struct.error) as error:
        raise RealizerError(f"wanted JSON, or a length, JSON and bytes: {error}") from None
    if not isinstance(asked, dict):
        raise RealizerError(f"wanted a JSON object, got {str(asked)[:80]!r}")
    return asked, payload
