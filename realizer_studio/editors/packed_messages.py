"""Messages between a page and its editors: JSON, or JSON followed by arrays or bytes."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from typing import Any

import numpy as np

from realizer.core.errors import RealizerError
from realizer.core.json_reader import parse_json

ALIGN = 8  # bytes; arrays begin at a multiple of it


def packed(header: Mapping[str, Any], arrays: Mapping[str, Any]) -> bytes:
    """Return JSON and arrays as one message: the length of the JSON (u32), the JSON, and the arrays.

    `arrays` in the JSON has for each name the numpy type, the size and the offset from the message's start.
    """
    rows = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
    index = {name: [array.dtype.str[1:], array.size, 0] for name, array in rows.items()}
    size = len(json.dumps({**header, "arrays": index})) + 12 * len(rows) + 4
    at = -(-size // ALIGN) * ALIGN
    start = at
    for name, array in rows.items():
        index[name][2] = at
        at += -(-array.nbytes // ALIGN) * ALIGN
    text = json.dumps({**header, "arrays": index}).ljust(start - 4).encode()
    parts: list[bytes | memoryview] = [len(text).to_bytes(4, "little"), text]
    for array in rows.values():
        parts += array.reshape(-1).view(np.uint8).data, bytes(-array.nbytes % ALIGN)
    return b"".join(parts)


def unpacked(message: str | bytes) -> tuple[dict[str, Any], bytes]:
    """Return the JSON of a message, and the bytes after it.

    Raises:
        RealizerError: the message is invalid.
    """
    try:
        if isinstance(message, str):
            header, payload = parse_json(message), b""
        else:
            (length,) = struct.unpack_from("<I", message)
            header, payload = parse_json(message[4 : 4 + length]), message[4 + length :]
    except (ValueError, struct.error) as error:
        raise RealizerError(f"wanted JSON, or a length, JSON and bytes: {error}") from None
    if not isinstance(header, dict):
        raise RealizerError(f"wanted a JSON object, got {str(header)[:80]!r}")
    return header, payload
