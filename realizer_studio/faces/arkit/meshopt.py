"""A decoder of buffer views compressed by meshopt.

Source: the text of the glTF extensions EXT_ and KHR_meshopt_compression, appendices A and B.
"""

from collections import deque
from collections.abc import Callable, Iterator
from itertools import count as numbers
from typing import Any

import numpy as np

EXTENSIONS = ("EXT_meshopt_compression", "KHR_meshopt_compression")
GROUP = 16  # elements that have one width in bits
LONGEST = 256  # elements of a block
WRAP = 0xFFFFFFFF
# Header byte -> widths in bits of a group by its two header bits, for each control mode (version 0 has one).
WIDTHS = {0xA0: ((0, 2, 4, 8),), 0xA1: ((0, 1, 2, 4), (1, 2, 4, 8))}
TAILS = {0xA0: 32, 0xA1: 24}  # least bytes of a tail
TRIANGLES, INDICES = 0xE1, 0xD1  # header bytes of the other modes
# Width -> the numbers packed in each byte; those of one bit begin at the lowest bit, others at the highest.
SMALL = {
    width: [
        bytes(byte >> (k * width if width == 1 else 8 - width - k * width) & (1 << width) - 1
              for k in range(8 // width))
        for byte in range(256)
    ]
    for width in (1, 2, 4)
}  # fmt: skip


def unpack(data: bytes, mode: str, transform: str, count: int, stride: int) -> bytes:
    """Return the count x stride bytes of a buffer view.

    Args:
        mode: ATTRIBUTES, TRIANGLES or INDICES; transform: NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL or COLOR.

    Raises:
        ValueError: the data are broken.
    """
    try:
        if mode == "ATTRIBUTES":
            if stride % 4:
                raise KeyError(f"stride {stride}")
            values = FILTERS[transform](_attributes(data, count, stride))
        else:
            found = _triangles(data, count) if mode == "TRIANGLES" else _indices(data, count)
            values = np.fromiter(found, np.uint32, count).astype(f"<u{stride}")
    except (IndexError, KeyError, TypeError, StopIteration) as error:
        raise ValueError(f"packed data end too early or are broken ({error})") from None
    return bytes(values.tobytes())


def _attributes(data: bytes, count: int, stride: int) -> Any:
    """Return elements (count, stride) uint8."""
    widths, channels = WIDTHS[data[0]], stride // 4 if data[0] == 0xA1 else 0
    tail = data[len(data) - stride - channels :]
    end, at = len(data) - max(len(tail), TAILS[data[0]]), 1
    longest = min(8192 // stride & ~(GROUP - 1), LONGEST)
    blocks = []
    for start in range(0, count, longest):
        size = min(longest, count - start)
        controls, at = data[at : at + channels], at + channels
        rows = []
        for byte in range(stride):
            control = controls[byte // 4] >> byte % 4 * 2 & 3 if channels else 0
            row, at = _row(data, at, size, widths[control] if control < 2 else None, control == 3)
            rows.append(row)
        if at > end:
            raise IndexError("data")
        blocks.append(np.frombuffer(b"".join(rows), np.uint8).reshape(stride, -1)[:, :size])
    if at != end:
        raise IndexError("tail")
    deltas = np.concatenate(blocks, axis=1).T
    modes = tail[stride:] or bytes(stride // 4)
    base = np.frombuffer(tail[:stride], np.uint8)
    out = np.empty((count, stride), np.uint8)
    for k, mode in enumerate(modes):
        part = slice(4 * k, 4 * k + 4)
        out[:, part] = _summed(deltas[:, part], base[part], mode)
    return out


def _row(data: bytes, at: int, size: int, widths: Any, literal: bool) -> tuple[bytes, int]:
    """Return the deltas of one byte of the elements of a block, and the offset after them."""
    groups = -(-size // GROUP)
    if widths is None:
        end = at + size if literal else at
        return data[at:end].ljust(groups * GROUP, b"\0"), end
    heads, at = data[at : at + -(-groups // 4)], at + -(-groups // 4)
    out = []
    for k in range(groups):
        width = widths[heads[k // 4] >> k % 4 * 2 & 3]
        if width == 8:
            out.append(data[at : at + GROUP])
            at += GROUP
        elif width:
            small = bytearray(b"".join([SMALL[width][byte] for byte in data[at : at + 2 * width]]))
            at, outside = at + 2 * width, (1 << width) - 1
            position = small.find(outside)
            while position >= 0:
                small[position] = data[at]
                at, position = at + 1, small.find(outside, position + 1)
            out.append(bytes(small))
        else:
            out.append(bytes(GROUP))
    return b"".join(out), at


def _summed(deltas: Any, base: Any, mode: int) -> Any:
    """Return four bytes of each element, (n, 4), from their differences."""
    kind, turn = mode & 15, mode >> 4
    if kind > 2 or (turn and kind < 2):
        raise KeyError(f"channel mode {mode}")
    words = np.ascontiguousarray(deltas).view(("u1", "<u2", "<u4")[kind])
    first = np.ascontiguousarray(base).view(words.dtype)
    if kind == 2:
        turned = words << np.uint32(turn) | words >> np.uint32(-turn & 31) if turn else words
        return (np.bitwise_xor.accumulate(turned, axis=0) ^ first).view(np.uint8)
    one = words.dtype.type(1)
    steps = words >> one ^ (0 - (words & one)).astype(words.dtype)
    return (np.cumsum(steps, axis=0, dtype=words.dtype) + first).view(np.uint8)


def _varint(data: Iterator[int]) -> int:
    out = 0
    for shift in (0, 7, 14, 21, 28):
        byte = next(data)
        out |= (byte & 127) << shift
        if byte < 128:
            return out & WRAP
    raise KeyError("number of more than five bytes")


def _signed(code: int) -> int:
    return ~(code >> 1) if code & 1 else code >> 1


def _indices(data: bytes, count: int) -> list[int]:
    if data[0] != INDICES:
        raise KeyError(f"header {data[0]}")
    rest, last, out = iter(data[1:-4]), [0, 0], []
    for _ in range(count):
        code = _varint(rest)
        last[code & 1] = last[code & 1] + _signed(code >> 1) & WRAP
        out.append(last[code & 1])
    return out


def _triangles(data: bytes, count: int) -> list[int]:
    if data[0] != TRIANGLES:
        raise KeyError(f"header {data[0]}")
    codes, rest, table = data[1 : 1 + count // 3], iter(data[1 + count // 3 : -16]), data[-16:]
    edges: deque[tuple[int, int]] = deque(maxlen=16)
    recent: deque[int] = deque(maxlen=16)
    unused, last, out = numbers(), 0, []

    def explicit() -> int:
        nonlocal last
        last = last + _signed(_varint(rest)) & WRAP
        return last

    for code in codes:
        high, low = code >> 4, code & 15
        if high < 15:
            a, b = edges[high]
            if low in (13, 14):
                c = last = last + (1 if low == 14 else -1) & WRAP
            else:
                c = next(unused) if low == 0 else explicit() if low == 15 else recent[low]
            if low == 0 or low > 12:
                recent.appendleft(c)
        else:
            pair = table[low] if low < 14 else next(rest)
            if low >= 14 and pair == 0:
                unused = numbers()
            corner = [explicit() if low == 15 else next(unused)]
            new = corner[:]
            for half in (pair >> 4, pair & 15):
                corner.append(next(unused) if half == 0 else explicit() if half == 15 else recent[half - 1])
                if half in (0, 15):
                    new.append(corner[-1])
            a, b, c = corner
            edges.appendleft((b, a))
            recent.extendleft(new)
        edges.appendleft((c, b))
        edges.appendleft((a, c))
        out += [a, b, c]
    return out


def _octahedral(raw: Any) -> Any:
    """Return unit vectors, and the fourth component unchanged."""
    kind = f"<i{raw.shape[1] // 4}"
    values = raw.view(kind).copy()
    flat = values[:, :2] / np.maximum(values[:, 2:3].astype(float), 1)
    z = 1 - np.abs(flat).sum(axis=1, keepdims=True)
    flat -= np.copysign(np.minimum(z, 0), flat)
    normals = np.hstack([flat, z])
    values[:, :3] = np.rint(normals / np.linalg.norm(normals, axis=1, keepdims=True) * np.iinfo(kind).max)
    return values


def _quaternions(raw: Any) -> Any:
    values = raw.view("<i2")
    small = values[:, :3] / (values[:, 3:] | 3) / np.sqrt(2)
    largest = np.sqrt(np.maximum(1 - (small**2).sum(axis=1), 0))
    out, row = np.empty(values.shape, "<i2"), np.arange(len(values))
    for k, value in enumerate((largest, *small.T)):
        out[row, ((values[:, 3] & 3) + k) % 4] = np.rint(value * 32767)
    return out


def _floats(raw: Any) -> Any:
    values = raw.view("<i4")
    return np.ldexp((values << 8 >> 8).astype("<f4"), values >> 24).astype("<f4")


def _colours(raw: Any) -> Any:
    width = raw.shape[1] // 4
    most = (1 << 8 * width) - 1
    y, orange, green, alpha = raw.view(f"<i{width}").astype(int).T
    y, alpha = y & most, alpha & most
    top = (1 << np.frexp(np.maximum(alpha, 1))[1]) - 1
    alpha = (alpha & top >> 1) << 1 | alpha & 1
    channels = np.stack([y + orange - green, y + green, y - orange - green, alpha], axis=1)
    return np.clip(np.rint(channels * (most / top[:, None])), 0, most).astype(f"<u{width}")


FILTERS: dict[str, Callable[[Any], Any]] = {
    "NONE": lambda raw: raw, "OCTAHEDRAL": _octahedral, "QUATERNION": _quaternions,
    "EXPONENTIAL": _floats, "COLOR": _colours,
}  # fmt: skip
