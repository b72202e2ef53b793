"""The WebSocket protocol of the service: other methods than GET get an answer, too."""

from __future__ import annotations

from collections.abc import Generator

from websockets.exceptions import InvalidMessage
from websockets.protocol import State
from websockets.server import ServerProtocol

LONGEST_METHOD = 8  # characters, with the blank after it
POST = "there is nothing to POST to: send BML through the WebSocket at /ws\n"
OTHERS = "wanted GET\n"


class Protocol(ServerProtocol):
    """The protocol of a connection."""

    def parse(self) -> Generator[None]:
        """Parse what the client sends. Refuse other methods here: the library cannot read their bodies."""
        if self.state is State.CONNECTING:
            while not (head := bytes(self.reader.buffer[:LONGEST_METHOD])).count(b" "):
                if len(head) == LONGEST_METHOD or self.reader.eof:
                    break
                yield
            method, blank, _ = head.partition(b" ")
            if blank and method.isalpha() and method != b"GET":
                self._refuse(method)
                yield
        yield from super().parse()

    def _refuse(self, method: bytes) -> None:
        response = self.reject(*((404, POST) if method == b"POST" else (405, OTHERS)))
        response.headers["Allow"] = "GET"
        if method == b"HEAD":
            response.body = b""
        self.handshake_exc = InvalidMessage(f"wanted GET, got {method.decode()}")
        self.send_response(response)
