"""WebSocket messages without a library: a text in, what a client sends out; what came in, messages out."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator

__all__ = ["HELLO", "greet", "masked", "messages"]

# What a client asks to be let in with; {} is its session.
HELLO = (
    "GET /ws?session={} HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)


def greet(one: socket.socket, session: str) -> bytearray:
    """Ask to be let in, and read that it is so; what has come behind that."""
    one.sendall(HELLO.format(session).encode())
    data = bytearray()
    while b"\r\n\r\n" not in data:
        data += (more := one.recv(4096))
        assert more, "the service hung up"
    assert data.startswith(b"HTTP/1.1 101"), bytes(data)
    return data.partition(b"\r\n\r\n")[2]


def masked(text: str) -> bytes:
    """A text message of less than 64 KiB as a client sends it; the mask is 0, which changes nothing."""
    data = text.encode()
    head = bytes([0x81, 0x80 | len(data)]) if len(data) < 126 else struct.pack(">BBH", 0x81, 0xFE, len(data))
    return head + bytes(4) + data


def messages(data: bytearray) -> Iterator[tuple[int, bytes]]:
    """(opcode, payload) of all that have come whole; they are taken out of `data`."""
    at = 0
    while len(data) >= at + 2:
        size, head = data[at + 1] & 0x7F, 2
        if size >= 126:
            form, head = (">H", 4) if size == 126 else (">Q", 10)
            if len(data) < at + head:
                break
            (size,) = struct.unpack_from(form, data, at + 2)
        if len(data) < at + head + size:
            break
        yield data[at] & 0x0F, bytes(data[at + head : at + head + size])
        at += head + size
    del data[:at]
