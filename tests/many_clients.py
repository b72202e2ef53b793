"""Loads a service with many clients: one after the other, or all at the same time."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import re
import socket
import struct
from pathlib import Path

from benchmarks.packets import HANDSHAKE, encode_text, handshake, take_messages
from tests.feedback_log import seq_numbers

__all__ = [
    "check_feedback",
    "connect_and_leave",
    "open_files",
    "open_websocket",
    "send_and_half_close",
    "send_simultaneously",
]

DOCUMENT = '<bml id="{}"><head id="n" lexeme="NOD" end="0.6"/><wait id="w" duration="0.3"/></bml>'
CLOSE_FRAME = b"\x88\x80" + bytes(4)


def open_files(process: int) -> int:
    """Return how many files a process of this machine has open."""
    return len(list(Path(f"/proc/{process}/fd").iterdir()))


def open_websocket(port: int, session: str) -> socket.socket:
    """Return a socket after the WebSocket handshake."""
    client = socket.create_connection(("127.0.0.1", port), 60)
    handshake(client, session)
    return client


def connect_and_leave(port: int, count: int, session_count: int) -> None:
    """Connect clients one after the other, each of which leaves in one of five ways."""
    for k in range(count):
        with open_websocket(port, f"passing-{k % session_count}") as client:
            match k % 5:
                case 0:  # it closes the WebSocket
                    client.sendall(CLOSE_FRAME)
                    while client.recv(4096):
                        pass
                case 1:  # its process ends
                    pass
                case 2:  # its machine is lost
                    client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
                case 3:  # it leaves in the middle of a message
                    client.sendall(encode_text(DOCUMENT.format("b"))[:20])
                case 4:  # it closes its side before it gets an answer
                    client.sendall(encode_text('{"type":"ping"}'))
                    client.shutdown(socket.SHUT_WR)


def send_and_half_close(port: int, session: str) -> bytes:
    """Send a document and close the sending side; return all that the service sends afterwards."""
    with open_websocket(port, session) as client:
        client.sendall(encode_text(DOCUMENT.format("b")))
        client.shutdown(socket.SHUT_WR)
        return b"".join(iter(lambda: client.recv(65536), b""))


async def _client(port: int, session: str, blocks: list[str], all_connected: asyncio.Barrier) -> list[str]:
    """Subscribe to frames, send the blocks when all clients do, and return the feedback up to their ends."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    feedback: list[str] = []
    try:
        writer.write(HANDSHAKE.format(session).encode())
        await reader.readuntil(b"\r\n\r\n")
        writer.write(encode_text(json.dumps({"type": "subscribe", "stream": "fap", "fps": 25})))
        data, playing, frames = bytearray(), set(blocks), 0
        await all_connected.wait()
        writer.write(b"".join(encode_text(DOCUMENT.format(block)) for block in blocks))
        while playing or not frames:
            data += (received := await reader.read(65536))
            assert received, "the service closed the connection"
            for code, payload in take_messages(data):
                frames += code == 2
                if code == 1 and payload.startswith(b"<"):
                    feedback.append(text := payload.decode())
                    if (end := re.search(r'blockProgress.* id="([^":]+):end"', text)) is not None:
                        playing.discard(end[1])
    finally:
        writer.close()
        with contextlib.suppress(OSError):
            await writer.wait_closed()
    return feedback


async def send_simultaneously(port: int, sessions: int, documents: int) -> list[list[str]]:
    """Send documents at the same time from many sessions that stream frames.

    Args:
        documents: a multiple of `sessions`.

    Returns:
        The feedback of each session up to the end of its last block.
    """
    all_connected = asyncio.Barrier(sessions)
    blocks = [f"b{k}" for k in range(documents // sessions)]
    names = [f"crowd-{os.getpid()}-{k}" for k in range(sessions)]
    return await asyncio.gather(*(_client(port, name, blocks, all_connected) for name in names))


def check_feedback(feedback: list[str], blocks: int) -> None:
    """Check that a session's feedback has every message once and in order, and the end of every block."""
    assert seq_numbers(feedback) == list(range(1, len(feedback) + 1))
    ends = [text for text in feedback if re.search(r'blockProgress.* id="b\d+:end"', text)]
    assert len(ends) == blocks
    assert all('status="DONE"' in text for text in ends)
