"""Escaping of text as XML character data and attribute values."""

from __future__ import annotations

import re

# Everything XML 1.0 has no way to write (production 2, Char).
_ILLEGAL = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_DATA = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "\r": "&#13;"})
# Most values are ASCII in which nothing needs to be escaped: to see that is cheaper than to go over them.
_plain = re.compile(r"[ !#-%'-;=?-~]*").fullmatch
# Readers turn bare line ends and tabs of attributes into blanks.
_ATTRIBUTE = str.maketrans(
    {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "\r": "&#13;", "\n": "&#10;", "\t": "&#9;"}
)


def _checked(text: str) -> str:
    bad = _ILLEGAL.search(text)
    if bad:
        raise ValueError(f"wanted characters XML can hold, got U+{ord(bad[0]):04X} at {bad.start()}")
    return text


def escape(text: str) -> str:
    """Character data; ValueError for characters XML cannot hold."""
    return _checked(text).translate(_DATA)


def escape_value(text: str) -> str:
    """The inside of a double-quoted attribute; ValueError for characters XML cannot hold."""
    return text if _plain(text) else _checked(text).translate(_ATTRIBUTE)


def sanitized_value(text: str) -> str:
    """The inside of a double-quoted attribute, with U+FFFD for what XML cannot hold."""
    return text if _plain(text) else escape_value(sanitized(text))


def sanitized(text: str) -> str:
    """The text with every character XML cannot hold replaced by U+FFFD."""
    return _ILLEGAL.sub("\ufffd", text)
