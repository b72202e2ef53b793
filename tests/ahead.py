"""Two viewers of a session at a real service: one gets rows ahead, the other each frame at its time."""

from __future__ import annotations

import asyncio
import json
from dataclasses import dataclass, field

import numpy as np
from websockets.asyncio.client import ClientConnection, connect

from realizer.protocol.wire import HEADER, unpack

__all__ = ["viewed"]

FPS = 25
AHEAD = 0.2  # s
SMILE = '<bml id="{}" composition="REPLACE"><faceLexeme id="f" lexeme="{}" start="0.3" end="5"/></bml>'


@dataclass
class _Viewed:
    """What a viewer got.

    Attributes:
        rows: frame number -> values, as shown at the end.
    """

    rows: dict[int, list[int]] = field(default_factory=dict)

    def add(self, message: bytes) -> None:
        """Add the rows of a message; it repeats none. A machine that stalls may leave some out."""
        frame = unpack(message)
        if frame.flush:
            self.rows = {number: row for number, row in self.rows.items() if number < frame.frame}
        assert frame.frame > max(self.rows, default=-1)
        rows = np.frombuffer(message, "<i4", offset=HEADER.size).reshape(-1, 68).tolist()
        self.rows |= dict(enumerate(rows, frame.frame))


async def viewed(url: str) -> tuple[dict[int, list[int]], dict[int, list[int]]]:
    """Watch a session while two documents change its plan, and check that both viewers get the same.

    Returns:
        Frame number -> values, of the viewer ahead and of the other.
    """
    early, late = _Viewed(), _Viewed()
    async with connect(url) as one, connect(url) as other:
        await _subscribe(one, AHEAD)
        await _subscribe(other, 0)
        for k, lexeme in enumerate(("SMILE", "SURPRISE")):
            await one.send(SMILE.format(f"smile{k}-{id(early)}", lexeme))
            end = max(late.rows, default=max(early.rows, default=0)) + FPS
            await asyncio.gather(_read(one, early, end), _read(other, late, end))
    both = early.rows.keys() & late.rows.keys()
    assert both
    assert {number: early.rows[number] for number in both} == {number: late.rows[number] for number in both}
    return early.rows, late.rows


async def _subscribe(socket: ClientConnection, ahead: float) -> None:
    await socket.send(json.dumps({"type": "subscribe", "stream": "fap", "fps": FPS, "ahead": ahead}))


async def _read(socket: ClientConnection, viewed: _Viewed, end: int) -> None:
    while max(viewed.rows, default=0) < end:
        message = await socket.recv()
        if isinstance(message, bytes):
            viewed.add(message)
