"""Many clients of one service, as one process without a library: they come and go, or all send at once."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import re
import socket
import struct
from pathlib import Path

from tests.benchmarks.packets import HELLO, greet, masked, messages
from tests.told import numbers

__all__ = ["at_once", "come_and_go", "files_open", "half_closed", "joined", "well_told"]

DOCUMENT = '<bml id="{}"><head id="n" lexeme="NOD" end="0.6"/><wait id="w" duration="0.3"/></bml>'
GOODBYE = b"\x88\x80" + bytes(4)


def files_open(process: int) -> int:
    """How many files a process of this machine has open."""
    return len(list(Path(f"/proc/{process}/fd").iterdir()))


def joined(port: int, session: str) -> socket.socket:
    """A client that was let in."""
    one = socket.create_connection(("127.0.0.1", port), 60)
    greet(one, session)
    return one


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
            for code, payload in messages(data):
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
