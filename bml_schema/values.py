"""Conversion of attribute text to Python values and back, with a description of what is accepted."""

import re
from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from typing import Any

MAX_SECONDS = 86400.0  # a day; longer times in a document are a unit mistake or an attack
_MAX_DIGITS = 400  # the smallest float written without exponent has 345 characters
_MAX_NAME = 256  # characters; ids come back in feedback start tags, which clients cut at 4096

# No exponent, NaN or infinity: the standard's numbers are plain decimals.
NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)")
_WHOLE = re.compile(r"[+-]?[0-9]+")
_FANCY = re.compile(r"[+-]?(?:nan|inf|infinity|[0-9.]+e[+-]?[0-9]+)", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class Value:
    """The values of an attribute."""

    wanted: str  # the end of the sentence "wanted ..."
    read: Callable[[str], Any]  # text -> value; raises ValueError
    write: Callable[[Any], str] = str  # value -> text, such that read(write(v)) == v
    type: str = "string"  # XSD type, which a test compares with the schema
    words: tuple[str, ...] = ()  # the closed set of words, or ()
    low: float | None = None  # the range of a number
    high: float | None = None  # the range of a number

    def fold(self, text: str) -> Any:
        """Return the value of a word in another case, or None."""
        for folded in (text.upper(), text.lower()) if self.words or self.type == "boolean" else ():
            try:
                return self.read(folded)
            except ValueError:
                pass
        return None


def decimal(value: float) -> str:
    """Format a number without exponent so that it reads back as the same float; ValueError for NaN."""
    text = repr(float(value))
    if "n" in text:  # inf, nan
        raise ValueError(f"wanted a finite number, got {value}")
    if "e" in text:
        text = format(Decimal(text), "f")
    return text.removesuffix(".0")


def describe_mismatch(wanted: str, got: str, shown: str) -> str:
    """Return `wanted 0..1, got 7`, with a hint if a number is written in a form that BML does not have."""
    hint = " (a plain decimal number, no exponent, NaN or infinity)" if _FANCY.fullmatch(got.strip()) else ""
    return f"wanted {wanted}{hint}, got {shown}"


def number(low: float, high: float, *, wanted: str = "") -> Value:
    """Return the Value of decimal numbers in low..high."""
    read = _reader(float, NUMBER, _MAX_DIGITS, low, high)
    return Value(wanted or f"{low:g}..{high:g}", read, decimal, "decimal", low=low, high=high)


def integer(low: int, high: int) -> Value:
    """Return the Value of whole numbers in low..high."""
    read = _reader(int, _WHOLE, 20, low, high)
    return Value(f"a whole number {low}..{high}", read, str, "integer", low=low, high=high)


def _reader(
    convert: Callable[[str], float], pattern: re.Pattern[str], longest: int, low: float, high: float
) -> Callable[[str], float]:
    def read(text: str) -> float:
        text = text.strip()
        if len(text) > longest or not pattern.fullmatch(text):
            raise ValueError(text)
        value = convert(text)
        if not low <= value <= high:
            raise ValueError(text)
        return value

    return read


def _stripped(good: Callable[[str], object]) -> Callable[[str], str]:
    """Return a reader of good text without the blanks around it."""

    def read(text: str) -> str:
        text = text.strip()
        if not good(text):
            raise ValueError(text)
        return text

    return read


def one_of(*words: str) -> Value:
    """Return the Value of a closed set of words."""
    listed = ", ".join(words[:-1]) + f" or {words[-1]}" if len(words) > 1 else words[0]
    return Value(listed, _stripped(frozenset(words).__contains__), str, "words", words=words)


_NAME = re.compile(rf"[^\s:]{{1,{_MAX_NAME}}}")


def is_name(text: str) -> bool:
    """Return whether a text, without blanks around it, can be the id of a behaviour or a sync."""
    return text != "bml" and bool((text.isalnum() and len(text) <= _MAX_NAME) or _NAME.fullmatch(text))


_read_name = _stripped(is_name)
_read_block_name = _stripped(
    lambda text: text not in ("", "bml") and ":" not in text and len(text) <= _MAX_NAME
)
_read_flag = _stripped(frozenset(("true", "1", "false", "0")).__contains__)


def _read_block_names(text: str) -> tuple[str, ...]:
    return tuple(_read_block_name(name) for name in text.split(",") if name.strip())


def _read_names(text: str) -> tuple[str, ...]:
    return tuple(_read_name(name) for name in re.split(r"[,\s]+", text.strip()) if name)


def _write_names(names: tuple[str, ...]) -> str:
    for name in names:
        if "," in name:
            raise ValueError(f'wanted a name without ",", which stands between names in a list, got "{name}"')
    return ",".join(names)


# An open set of words.
word = Value("a word", _stripped(bool))
string = Value("text", str)
flag = Value(
    "true or false",
    lambda text: _read_flag(text) in ("true", "1"),
    lambda v: "true" if v else "false",
    "boolean",
)
seconds = number(-MAX_SECONDS, MAX_SECONDS, wanted=f"seconds, at most {MAX_SECONDS:g}")
# Ids have no colon, because references and feedback ids are joined with it. Those of behaviours have no
# blank, because "a - 1" must always mean an offset. "bml" is the block itself in references.
block_name = Value(
    f'a name of at most {_MAX_NAME} characters without ":", other than "bml"', _read_block_name, type="name"
)
name = Value(
    f'a name of at most {_MAX_NAME} characters without blanks or ":", other than "bml"',
    _read_name,
    type="name",
)
# BMLA separates names by commas; ids of behaviours have no blanks, so that blanks may separate them too.
block_names = Value("names of blocks with commas between them", _read_block_names, _write_names, "blockNames")
names = Value("names of behaviours with commas between them", _read_names, _write_names, "names")
