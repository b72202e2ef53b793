"""Many clients of one service, as one process without a library: they come and go, or all send at once."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import re
import socket
import struct
from collections.abc import Iterator
from pathlib import Path

from tests.told import numbers

__all__ = ["at_once", "come_and_go", "files_open", "greet", "half_closed", "joined", "masked", "well_told"]

HELLO = (
    "GET /ws?session={} HTTP/1.1\r\nHost: x\r\nUpgrade: websocket\r\nConnection: Upgrade\r\n"
    "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\nSec-WebSocket-Version: 13\r\n\r\n"
)
DOCUMENT = '<bml id="{}"><head id="n" lexeme="NOD" end="0.6"/><wait id="w" duration="0.3"/></bml>'
GOODBYE = b"\x88\x80" + bytes(4)


def files_open(process: int) -> int:
    """How many files a process of this machine has open."""
    return len(list(Path(f"/proc/{process}/fd").iterdir()))


def masked(text: str) -> bytes:
    """A text message as a client sends it, with a mask of zeros, which changes nothing."""
    body = text.encode()
    if len(body) < 126:
        return bytes([0x81, 0x80 | len(body)]) + bytes(4) + body
    return struct.pack(">BBH", 0x81, 0xFE, len(body)) + bytes(4) + body


def joined(port: int, session: str) -> socket.socket:
    """A client that was let in."""
    one = socket.create_connection(("127.0.0.1", port), 60)
    greet(one, session)
    return one


def greet(one: socket.socket, session: str) -> None:
    """Ask to be let in, and read that it is so."""
    one.sendall(HELLO.format(session).encode())
    head = b""
    while b"\r\n\r\n" not in head:
        head += (more := one.recv(4096))
        assert more, "the service hung up"
    assert head.startswith(b"HTTP/1.1 101"), head


def come_and_go(port: int, many: int, names: int) -> None:
    """Clients that come one after the other and go, each in one of the ways in which clients go.

    Args:
        names: of how many sessions.
    """
    for k in range(many):
        with joined(port, f"passing-{k % names}") as one:
            match k % 5:
                case 0:  # it takes its leave
                    one.sendall(GOODBYE)
                    while one.recv(4096):
                        pass
                case 1:  # its process ends
                    pass
                case 2:  # its machine is gone
                    one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                case 3:  # in the middle of a message
                    one.sendall(masked(DOCUMENT.format("b"))[:20])
                case 4:  # it has had its say
                    one.sendall(masked('{"type":"ping"}'))
                    one.shutdown(socket.SHUT_WR)


def half_closed(port: int, session: str) -> bytes:
    """All that comes to a client that sends a document and closes its side, but would read on."""
    with joined(port, session) as one:
        one.sendall(masked(DOCUMENT.format("b")))
        one.shutdown(socket.SHUT_WR)
        return b"".join(iter(lambda: one.recv(65536), b""))


def _messages(data: bytearray) -> Iterator[tuple[int, bytes]]:
    """(opcode, payload) of what has come whole; it is taken out of `data`."""
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


async def _client(port: int, session: str, blocks: list[str], all_in: asyncio.Barrier) -> list[str]:
    """Stream, send all at the moment at which everybody does, and hear every block end: the feedback."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    told: list[str] = []
    try:
        writer.write(HELLO.format(session).encode())
        await reader.readuntil(b"\r\n\r\n")
        writer.write(masked(json.dumps({"type": "subscribe", "stream": "fap", "fps": 25})))
        data, left, frames = bytearray(), set(blocks), 0
        await all_in.wait()
        writer.write(b"".join(masked(DOCUMENT.format(block)) for block in blocks))
        while left or not frames:
            data += (more := await reader.read(65536))
            assert more, "the service hung up"
            for code, payload in _messages(data):
                frames += code == 2
                if code == 1 and payload.startswith(b"<"):
                    told.append(text := payload.decode())
                    if (end := re.search(r'blockProgress.* id="([^":]+):end"', text)) is not None:
                        left.discard(end[1])
    finally:
        writer.close()
        with contextlib.suppress(OSError):
            await writer.wait_closed()
    return told


async def at_once(port: int, sessions: int, documents: int) -> list[list[str]]:
    """So many streaming sessions get so many documents in one moment; what each was told up to its last end.

    `documents` is a multiple of `sessions`.
    """
    each, all_in = documents // sessions, asyncio.Barrier(sessions)
    blocks = [f"b{k}" for k in range(each)]
    name = f"crowd-{os.getpid()}"
    return await asyncio.gather(*(_client(port, f"{name}-{k}", blocks, all_in) for k in range(sessions)))


def well_told(told: list[str], blocks: int) -> None:
    """The feedback of one session is there, each message once and in order."""
    assert numbers(told) == list(range(1, len(told) + 1))
    ends = [text for text in told if re.search(r'blockProgress.* id="b\d+:end"', text)]
    assert len(ends) == blocks
    assert all('status="DONE"' in text for text in ends)
