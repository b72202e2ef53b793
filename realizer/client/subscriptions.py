"""Iterations over what arrives, and over the frames of a subscription, which ends with them."""

import asyncio
import contextlib
import math
import time
from collections import deque
from collections.abc import AsyncIterator, Mapping
from typing import Any, TypeVar

from realizer.client.connection import Connection
from realizer.client.errors import ClientError, ClosedError
from realizer.client.message_router import Arrivals, Playout, Receiver

T = TypeVar("T")
CATCH_UP = 0.01  # s


async def play_out(
    connection: Connection, stream: str, ahead: float, options: Mapping[str, Any]
) -> AsyncIterator[Any]:
    """Subscribe, and yield each frame at its time; those long past are left out, and counted.

    Arguments and errors as of `Client.faps`.
    """
    playout = Playout(ahead)
    with contextlib.suppress(ClosedError):
        async with _subscribed(connection, stream, playout, {**options, "ahead": ahead}):
            while True:
                await _catch_up(playout)
                before = playout.left_out
                if (frame := playout.take(time.monotonic())) is not None:
                    connection.router.left_out[stream] += playout.left_out - before
                    yield frame
                    continue
                due = playout.next_due
                pause = None if due == math.inf else due - time.monotonic()
                with contextlib.suppress(TimeoutError):
                    async with asyncio.timeout(pause):
                        await connection.wait_for(lambda due=due: playout.next_due != due)  # type: ignore[misc]


async def _catch_up(playout: Playout) -> None:
    """While the next frame is long past, wait for newer ones, which may have arrived and are not read."""
    seen = -1
    while playout.is_late(time.monotonic()) and seen != playout.received:
        seen = playout.received
        await asyncio.sleep(CATCH_UP)


async def take_subscribed(
    connection: Connection, stream: str, options: Mapping[str, Any]
) -> AsyncIterator[Any]:
    """Subscribe, and yield frames as they arrive. Errors as of `Client.faps`."""
    arrivals = Arrivals()
    with contextlib.suppress(ClosedError):
        async with _subscribed(connection, stream, arrivals, options):
            async for frame in take(connection, arrivals.frames):
                yield frame


async def take(connection: Connection, queue: deque[T]) -> AsyncIterator[T]:
    """Yield what arrives in a queue, until the connection is closed. Errors as of `Client.frames`."""
    with contextlib.suppress(ClosedError):
        while True:
            await connection.wait_for(lambda: bool(queue))
            yield queue.popleft()


@contextlib.asynccontextmanager
async def _subscribed(
    connection: Connection, stream: str, receiver: Receiver, options: Mapping[str, Any]
) -> AsyncIterator[None]:
    """Subscribe for a receiver, until the block is left."""
    character, receivers = options.get("character"), connection.router.receivers
    receivers[stream, character] = receiver
    try:
        await connection.ask("subscribe", stream=stream, **options)
        yield
    finally:
        if receivers.get((stream, character)) is receiver:
            del receivers[stream, character]
            with contextlib.suppress(ClientError):
                await connection.control("unsubscribe", stream=stream, character=character)
