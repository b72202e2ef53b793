"""The base of transports that show a session on an avatar in another program, by UDP."""

import asyncio
import json
from abc import abstractmethod
from collections.abc import Callable, Iterable, Sequence

from realizer.core.settings import Settings
from realizer.server.runtime.session_host import SessionHost
from realizer.server.runtime.session_registry import JoinError
from realizer.server.transports.reconnecting import ReconnectingTransport

LOOK_INTERVAL = 0.2  # s; how often the session to show is looked for


class AvatarTransport(ReconnectingTransport):
    """A transport that sends each ARKit frame of a session's first character in UDP packets.

    The session is `settings.avatar_session`, or the oldest one that has a client. It makes no difference
    whether a program receives the packets.
    """

    def __init__(self, name: str, peer: str, sessions: SessionHost, settings: Settings) -> None:
        super().__init__(name, peer)
        self._sessions = sessions
        self._session = settings.avatar_session
        self._fps = settings.avatar_fps
        self._shown: str | None = None
        self._number = 0
        self._udp: asyncio.DatagramTransport | None = None

    @abstractmethod
    def packets(self, frame: int, time: float, values: Sequence[float]) -> Iterable[bytes]:
        """Return the packets of a frame of the stream arkit: its number, its seconds and its 59 values."""

    @property
    def startup_lines(self) -> tuple[str, ...]:
        shown = "the oldest session with a client" if self._session is None else f"session {self._session}"
        return (f"{self._name}: {self._peer} shows {shown}",)

    def stop_accepting(self) -> None:
        """Continue, because playing blocks are shown to their end."""

    @property
    def unsent_bytes(self) -> int:
        """Always 0, because packets do not wait for a receiver."""
        return 0

    def send(self, data: str | bytes) -> None:
        if self._udp is None or not isinstance(data, str) or not data.startswith("{"):
            return
        message = json.loads(data)
        if message["type"] == "arkit":
            for packet in self.packets(message["frame"], message["time"], message["values"]):
                self._udp.sendto(packet)

    def disconnect(self, code: int, reason: str) -> None:
        self._loop.call_soon(self._show, None)  # the session is looked for again

    async def _serve(self, connected: Callable[[], None]) -> str:
        try:
            self._udp, _ = await self._loop.create_datagram_endpoint(
                asyncio.DatagramProtocol, remote_addr=self._address
            )
            self._follow()
            connected()
            self._up.set()
            while True:
                await asyncio.sleep(LOOK_INTERVAL)
                self._follow()
        except JoinError as error:
            return str(error)
        except OSError as error:
            return f"cannot send to {self._peer} ({error.strerror or error})"
        finally:
            self._show(None)
            if self._udp is not None:
                self._udp.close()
                self._udp = None

    def _follow(self) -> None:
        self._show(self._session or self._sessions.oldest_in_use(AvatarTransport))

    def _show(self, session: str | None) -> None:
        """Leave the session that is shown, and join another one."""
        if session == self._shown:
            return
        if self._shown is not None:
            self._shown = None
            self._sessions.leave(self._number)
        if session is not None:
            self._number = self._sessions.join(self, session)
            self._shown = session
            wanted = {"type": "subscribe", "stream": "arkit", "encoding": "json", "fps": self._fps}
            for message in ({"type": "unsubscribe", "stream": "feedback"}, wanted):
                self._sessions.receive(self._number, json.dumps(message))
