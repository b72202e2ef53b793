"""The runner of sessions' effects: it sends to clients, and lets engines speak and draw."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

from realizer.core import work
from realizer.server.runtime.engines import Engines
from realizer.server.runtime.fair_pool import FairPool
from realizer.server.session.effects import Close, Draw, Effect, Send, Speak
from realizer.server.session.session import Session
from realizer.server.transports.transport import Outbound


class EffectRunner:
    """Carries out the effects of sessions in an event loop.

    Args:
        loop: the event loop.
        engines: speak and draw, in threads.
        clients: number of a connection -> its way out.
        deliver: called in the loop with a session, and a function that passes it an answer.
    """

    def __init__(
        self,
        loop: asyncio.AbstractEventLoop,
        engines: Engines,
        clients: Mapping[int, Outbound],
        deliver: Callable[[Session, Callable[[], None]], None],
    ) -> None:
        self._loop = loop
        self._engines = engines
        self._clients = clients
        self._deliver = deliver

    def run(self, session: Session, effects: Iterable[Effect]) -> None:
        """Carry out effects of a session, in order."""
        for effect in work.counted(effects, 5):
            match effect:
                case Send(connection, data):
                    if (client := self._clients.get(connection)) is not None:
                        client.send(data)
                case Speak():
                    self._submit(self._engines.speech_pool, self._engines.speak, session, effect)
                case Draw():
                    self._submit(self._engines.render_pool, self._engines.draw, session, effect)
                case Close(connection, code, reason):
                    if (client := self._clients.get(connection)) is not None:
                        client.disconnect(code, reason)

    def _submit(
        self, pool: FairPool, compute: Callable[[Any], Any], session: Session, effect: Speak | Draw
    ) -> None:
        """Compute the answer to an effect in a thread, and pass it to the session."""
        take = session.on_speech if isinstance(effect, Speak) else session.on_picture

        def answer(future: asyncio.Future[Any]) -> None:
            if not future.cancelled():
                result = future.result()
                self._deliver(session, lambda: take(effect.id, result, self._loop.time()))

        computed = pool.submit(session, partial(compute, effect))
        asyncio.wrap_future(computed, loop=self._loop).add_done_callback(answer)
