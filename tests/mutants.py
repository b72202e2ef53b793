"""Sound and broken documents in, their mutants out: what a network, an editor or an enemy makes of them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from random import Random

__all__ = ["mutants"]

Mutation = Callable[[bytes, bytes, Random], bytes]

_MOST = 200_000  # bytes; what grows beyond is cut
_VALUE = re.compile(rb"=\s*(\"[^\"]*\"|'[^']*')")
_TAG = re.compile(rb"</?([A-Za-z_:][\w:.-]*)")
_ELEMENT = re.compile(rb"<([\w:.-]+)[^<>]*?(?:/>|>[^<>]*</\1\s*>)")
_NUMBER = re.compile(rb"[+-]?\d+(?:\.\d+)?")
_WORD = re.compile(rb"[A-Za-z]{2,}")
_NUMBERS = (
    *(b"0", b"-0", b"-1", b"1e308", b"1e-400", b"NaN", b"-Infinity", b"0x10", b"1.", b".", b"", b"+"),
    *(b"99999999999999999999", b"0.0000000000000000001", b"86400", b"86401", b"-86400", b"1_0", b"1,5"),
    *("\u0663".encode(), "\u00bd".encode(), b"9" * 400, b"0." + b"0" * 500 + b"1"),
)
_PIECES = (
    *(
        b"<",
        b">",
        b"&",
        b'"',
        b"'",
        b"/>",
        b"</bml>",
        b"<bml>",
        b"<bml id='n'>",
        b"<!--",
        b"-->",
        b"<![CDATA[",
    ),
    *(b"]]>", b"<?xml?>", b"<?", b"?>", b"<!DOCTYPE bml [<!ENTITY l 'l'>]>", b"&l;", b"&#0;", b"&#xFFFE;"),
    *(b"xmlns=''", b"xmlns:x='urn:x'", b"x:", b":", b"bml:", b"\x00", b"\xff", b"\xc0\x80", b"\xed\xa0\x80"),
    *("\ufeff".encode(), "\u2028".encode(), "\u202e".encode(), "\U0001f600".encode(), b"\r", b"\t", b"\x1b"),
    *(b"<required>", b"</required>", b"<speech id='s'><text>", b"<sync id='a'/>", b"start='a:end'"),
)


def _flip(data: bytes, other: bytes, random: Random) -> bytes:
    out = bytearray(data)
    for _ in range(random.randint(1, 4)):
        if out:
            out[random.randrange(len(out))] ^= 1 << random.randrange(8)
    return bytes(out)


def _span(data: bytes, random: Random, most: int = 60) -> tuple[int, int]:
    start = random.randrange(len(data) + 1)
    return start, min(len(data), start + random.randint(1, most))


def _delete(data: bytes, other: bytes, random: Random) -> bytes:
    start, end = _span(data, random)
    return data[:start] + data[end:]


def _duplicate(data: bytes, other: bytes, random: Random) -> bytes:
    start, end = _span(data, random, 300)
    return data[:end] + data[start:end] * random.choice((1, 1, 2, 50)) + data[end:]


def _insert(data: bytes, other: bytes, random: Random) -> bytes:
    start, _ = _span(data, random)
    return data[:start] + random.choice(_PIECES) + data[start:]


def _truncate(data: bytes, other: bytes, random: Random) -> bytes:
    start, _ = _span(data, random)
    return data[:start] if random.random() < 0.8 else data[start:]


def _splice(data: bytes, other: bytes, random: Random) -> bytes:
    return data[: _span(data, random)[0]] + other[_span(other, random)[0] :]


def _chain(data: bytes, other: bytes, random: Random) -> bytes:
    return data + random.choice((b"", b"\n", b"text", b"<!-- -->")) + other


def _exchange(data: bytes, spans: Sequence[tuple[int, int]], random: Random) -> bytes:
    """Two of the spans change places."""
    if len(spans) < 2:
        return data
    (a, b), (c, d) = sorted(random.sample(spans, 2))
    return data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def _swap_values(data: bytes, other: bytes, random: Random) -> bytes:
    return _exchange(data, [m.span(1) for m in _VALUE.finditer(data)], random)


def _swap_tags(data: bytes, other: bytes, random: Random) -> bytes:
    return _exchange(data, [m.span(1) for m in _TAG.finditer(data)], random)


def _swap_elements(data: bytes, other: bytes, random: Random) -> bytes:
    return _exchange(data, [m.span() for m in _ELEMENT.finditer(data)], random)


def _replace(pattern: re.Pattern[bytes], with_: Callable[[bytes, Random], bytes]) -> Mutation:
    def mutate(data: bytes, other: bytes, random: Random) -> bytes:
        found = list(pattern.finditer(data))
        if not found:
            return data
        one = random.choice(found)
        return data[: one.start()] + with_(one[0], random) + data[one.end() :]

    return mutate


def _transplant(data: bytes, other: bytes, random: Random) -> bytes:
    """An element of the other document comes in behind some tag."""
    found = list(_ELEMENT.finditer(other))
    places = [m.end() for m in re.finditer(rb">", data)]
    if not found or not places:
        return data
    at = random.choice(places)
    return data[:at] + random.choice(found)[0] + data[at:]


def _nest(data: bytes, other: bytes, random: Random) -> bytes:
    tag = random.choice((b"required", b"a", b"bml", b"head", b"constraint", b"b:c"))
    depth = random.choice((2, 50, 300, 5000))
    start, end = _span(data, random, 200)
    opened = b"<" + tag + random.choice((b"", b" id='x'")) + b">"
    closed = b"</" + tag + b">" if random.random() < 0.7 else b""
    return data[:start] + opened * depth + data[start:end] + closed * depth + data[end:]


def _unicode(word: bytes, random: Random) -> bytes:
    return "".join(chr(random.randrange(0x10FFFF)) for _ in range(random.randint(1, 30))).encode(
        "utf-8", "surrogatepass"
    )


def _long(word: bytes, random: Random) -> bytes:
    return word * random.choice((10, 1000, 5000))


def _recode(data: bytes, other: bytes, random: Random) -> bytes:
    encoding = random.choice(("utf-16", "utf-16-le", "latin-1", "utf-32", "utf-8-sig", "utf-7", "cp037"))
    declared = (
        b"<?xml version='1.0' encoding='" + encoding.encode() + b"'?>" if random.random() < 0.5 else b""
    )
    return (declared + data).decode("utf-8", "replace").encode(encoding, "replace")


MUTATIONS: Sequence[Mutation] = (
    *(_flip, _delete, _duplicate, _insert, _insert, _truncate, _splice, _chain, _transplant, _nest, _recode),
    *(_swap_values, _swap_values, _swap_tags, _swap_elements),
    _replace(_NUMBER, lambda number, random: random.choice(_NUMBERS)),
    _replace(_NUMBER, lambda number, random: random.choice(_NUMBERS)),
    _replace(_WORD, _unicode),
    _replace(_WORD, _long),
    _replace(_WORD, lambda word, random: word.swapcase()),
    _replace(_VALUE, lambda value, random: b'=""'),
)


def mutants(documents: Sequence[bytes], count: int, seed: int = 0) -> Iterator[bytes]:
    """`count` documents with one to four mutations each; the same for the same seed and documents."""
    random = Random(seed)
    for _ in range(count):
        data, other = random.choice(documents), random.choice(documents)
        for _ in range(random.choice((1, 1, 1, 2, 2, 3, 4))):
            data = random.choice(MUTATIONS)(data, other, random)[:_MOST]
        yield data
