"""Escaping of text as XML character data and attribute values."""

import re

# The characters that XML 1.0 cannot hold (production 2, Char).
ILLEGAL = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
_DATA = str.maketrans({"&": "&amp;", "<": "&lt;", ">": "&gt;", "\r": "&#13;"})
# Most values are ASCII without special characters; this check is cheaper than a translation.
_plain = re.compile(r"[ !#-%'-;=?-~]*").fullmatch
# XML parsers turn bare line ends and tabs in attributes into blanks.
_ATTRIBUTE = str.maketrans(
    {"&": "&amp;", "<": "&lt;", ">": "&gt;", '"': "&quot;", "\r": "&#13;", "\n": "&#10;", "\t": "&#9;"}
)


def _checked(text: str) -> str:
    bad = ILLEGAL.search(text)
    if bad:
        raise ValueError(f"wanted characters XML can hold, got U+{ord(bad[0]):04X} at {bad.start()}")
    return text


def escape(text: str) -> str:
    """Escape character data; raise ValueError for characters XML cannot hold."""
    return _checked(text).translate(_DATA)


def escape_value(text: str) -> str:
    """Escape the value of a double-quoted attribute; raise ValueError for characters XML cannot hold."""
    return text if _plain(text) else _checked(text).translate(_ATTRIBUTE)


def sanitized_value(text: str) -> str:
    """Escape the value of a double-quoted attribute, with U+FFFD for characters XML cannot hold."""
    return text if _plain(text) else escape_value(sanitized(text))


def sanitized(text: str) -> str:
    """Replace every character XML cannot hold by U+FFFD."""
    return ILLEGAL.sub("\ufffd", text)
