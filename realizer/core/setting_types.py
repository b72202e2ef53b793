"""The types of settings: each converts a value, or raises ValueError with the wanted values."""

import ipaddress
import math
import os
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

T = TypeVar("T")
MIN_SECRET = 32  # characters, the key length of HS256 (RFC 7518, 3.2)


def _number(kind: type[int] | type[float], low: float, high: float) -> Callable[[Any], Any]:
    wanted = f"{'a whole number' if kind is int else 'a number'} {low:g}..{high:g}"

    def read(value: Any) -> Any:
        try:
            number = kind(value)
        except (TypeError, ValueError, OverflowError):
            raise ValueError(wanted) from None
        cut = kind is int and isinstance(value, float) and number != value
        if isinstance(value, bool) or cut or not math.isfinite(number) or not low <= number <= high:
            raise ValueError(wanted)
        return number

    return read


# Both are called with the least and the greatest number.
whole, real = partial(_number, int), partial(_number, float)


def flag(value: Any) -> bool:
    """Return the truth of a value, or of a word such as "on"."""
    word = str(value).strip().lower()
    if word not in ("1", "true", "yes", "on", "0", "false", "no", "off"):
        raise ValueError("true or false")
    return word in ("1", "true", "yes", "on")


def ports(value: Any) -> tuple[int, int]:
    """Return two ports, from a list or a text."""
    port = whole(0, 65535)
    items = value.replace(",", " ").split() if isinstance(value, str) else value
    if not isinstance(items, list | tuple) or len(items) != 2 or port(items[1]) == 0:
        raise ValueError("two ports, of which the first may be 0")
    return port(items[0]), port(items[1])


def address(value: Any) -> str:
    """Return HOST:PORT."""
    host, _, port = str(value).rpartition(":")
    if not host or not port.isascii() or not port.isdecimal() or not 0 < int(port) < 65536:
        raise ValueError("HOST:PORT")
    return f"{host}:{int(port)}"


def matching(pattern: str, wanted: str) -> Callable[[Any], str]:
    """Return the type of the texts that match a regular expression; `wanted` describes it."""

    def read(value: Any) -> str:
        if not isinstance(value, str) or not re.fullmatch(pattern, value):
            raise ValueError(wanted)
        return value

    return read


def word_of(*words: str) -> Callable[[Any], str]:
    """Return the type that has only these words."""
    return matching("|".join(words), " or ".join(words))


text = matching(r"(?s).*\S.*", "a word")


def path(value: Any) -> Path:
    """Return a path that need not exist."""
    if not isinstance(value, str | Path):
        raise ValueError("the name of a file or folder")
    return Path(value)


def _existing(is_kind: Callable[[Path], object], kind: str) -> Callable[[Any], Path]:
    def read(value: Any) -> Path:
        if not is_kind(found := path(value)):
            raise ValueError(f"an existing {kind}")
        return found

    return read


folder, file = _existing(os.path.isdir, "folder"), _existing(os.path.isfile, "file")
writable_folder = _existing(
    lambda path: path.is_dir() and os.access(path, os.W_OK | os.X_OK), "folder that can be written to"
)


def background(value: Any) -> str:
    """Return "transparent", "#rrggbb", or the name of a file."""
    named = isinstance(value, str) and re.fullmatch(r"#[0-9a-fA-F]{6}|transparent", value)
    if not named and not (isinstance(value, str | Path) and os.path.isfile(value)):  # noqa: PTH113
        raise ValueError("transparent, a colour such as #d8dde2, or an existing file")
    return str(value)


def switch_or_file(value: Any) -> str:
    """Return "on", "off", or the name of a file."""
    try:
        return "on" if flag(value) else "off"
    except ValueError:
        # Path.is_file raises for a text that is longer than a path can be.
        if not isinstance(value, str | Path) or not os.path.isfile(value):  # noqa: PTH113
            raise ValueError("on, off, or an existing file") from None
        return str(value)


def _several(read: Callable[[str], str], wanted: str) -> Callable[[Any], tuple[str, ...]]:
    """Return a parser of several values, from a list or a text; `read` parses one of them."""

    def parse(value: Any) -> tuple[str, ...]:
        items = value.replace(",", " ").split() if isinstance(value, str) else value
        try:
            if isinstance(items, list | tuple):
                return tuple(read(str(item)) for item in items)
        except ValueError:
            pass
        raise ValueError(wanted)

    return parse


# An origin has a scheme and a host, but no path.
origins = _several(
    matching(r"[a-z][a-z0-9+.-]*://[^/\s]+/?|null|\*", ""), "addresses such as https://example.org, or *"
)


def _host_name(text: str) -> str:
    name = text.lower().strip("[]")
    if ":" in name:
        return str(ipaddress.IPv6Address(name))
    return matching(r"[a-z0-9._-]+", "")(name)


hosts = _several(_host_name, "names or addresses without a port, such as face.example")
networks = _several(
    lambda text: str(ipaddress.ip_network(text, strict=False)), "addresses or networks such as 192.168.1.0/24"
)
# As uvicorn has them.
proxies = _several(
    lambda text: text if text == "*" else str(ipaddress.ip_network(text, strict=False)),
    "addresses or networks of proxies such as 10.0.0.0/8, or *",
)


def key(value: Any) -> str:
    """Return a public key in PEM or a secret; `value` is the key or its file."""
    wanted = f"an existing PEM file, or a secret of at least {MIN_SECRET} characters"
    if not isinstance(value, str | Path) or not str(value).strip():
        raise ValueError(wanted)
    text = str(value)
    try:
        if "-----BEGIN" not in text and Path(text).is_file():
            text = Path(text).read_text("utf-8")
    except OSError:
        pass  # a secret may be longer than a file name can be
    except UnicodeDecodeError:
        raise ValueError(wanted) from None
    text = text.strip()
    # A misspelt file name must not become a secret.
    if "-----BEGIN" not in text and (len(text) < MIN_SECRET or text.endswith((".pem", ".key", ".pub"))):
        raise ValueError(wanted)
    return text


def optional(read: Callable[[Any], T], empty: bool = True) -> Callable[[Any], T | None]:
    """Return a type that has None too, which "" means as well if `empty`."""
    return lambda value: None if value is None or (empty and value == "") else read(value)
