"""Encodes and decodes WebSocket messages without a library, for clients that must cost little."""

from __future__ import annotations

import socket
import struct
from collections.abc import Iterator

__all__ = ["HANDSHAKE", "encode_text", "handshake", "take_messages"]

# The opening request of a client; {} is the name of its session.
HANDSHAKE = (
    "GET /ws?session={} HTTP/1.1\r\nHost: localhost\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)


def handshake(client: socket.socket, session: str) -> bytearray:
    """Open a WebSocket on a connected socket; return the bytes that were received after the handshake."""
    client.sendall(HANDSHAKE.format(session).encode())
    data = bytearray()
    while b"\r\n\r\n" not in data:
        data += (received := client.recv(4096))
        assert received, "the service closed the connection"
    if not data.startswith(b"HTTP/1.1 101"):
        raise ConnectionRefusedError(bytes(data))
    return data.partition(b"\r\n\r\n")[2]


def encode_text(text: str) -> bytes:
    """Return the client's frame of a text of less than 64 KiB; its mask is 0, which changes nothing."""
    data = text.encode()
    head = bytes([0x81, 0x80 | len(data)]) if len(data) < 126 else struct.pack(">BBH", 0x81, 0xFE, len(data))
    return head + bytes(4) + data


def take_messages(data: bytearray) -> Iterator[tuple[int, bytes]]:
    """Yield (opcode, payload) of each complete message, and remove these messages from `data`."""
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
