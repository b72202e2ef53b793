"""Control messages that wait for their answers; which reply is about which of them."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import count
from typing import Any

from realizer.protocol.messages.common import ANSWERS

_SUBSCRIPTION = ("stream", "character", "view")


@dataclass(eq=False)
class ControlRequest:
    """A control message that was sent.

    Attributes:
        message: its fields.
        mark: id of the ping that is sent behind a message without an answer, whose pong shows that the
            service has taken it; None for others.
        is_sent: whether it has been sent, with its ping.
        reply: its answer, the pong, or the error; None until it comes.
    """

    message: dict[str, Any]
    mark: str | None = None
    is_sent: bool = False
    reply: dict[str, Any] | None = None

    @property
    def texts(self) -> list[str]:
        """The messages to send."""
        ping = [] if self.mark is None else [json.dumps({"type": "ping", "id": self.mark})]
        return [json.dumps(self.message), *ping]

    def is_answered_by(self, reply: dict[str, Any]) -> bool:
        """Return whether a reply may be about it, if it is the first one for which this is so."""
        type, own, id = reply["type"], self.message["type"], self.message.get("id")
        if type == "error":
            if (where := reply.get("where")) is None:  # about a text that could not be parsed
                return True
            if where == "type":
                return str(reply["message"]).endswith(f"got {json.dumps(own)}")
            return bool(where.partition(".")[0] == own and reply.get("id", id) == id)
        if self.mark is not None or type == "pong":
            fits = self.mark is not None or own == "ping"
            return bool(type == "pong" and fits and reply.get("id") == (self.mark or id))
        if type == "subscribed":
            return own == "subscribe" and all(reply.get(n) == self.message.get(n) for n in _SUBSCRIPTION)
        return bool(ANSWERS.get(own) == type)


@dataclass(eq=False)
class ControlRequests:
    """The requests of a connection that wait, in the order in which they were sent.

    The service answers in this order: what is refused has its error before the pong behind it.
    """

    waiting: list[ControlRequest] = field(default_factory=list)
    _marks: Iterator[int] = field(default_factory=count)

    def add(self, type: str, fields: dict[str, Any]) -> ControlRequest:
        """Return a new request, which waits from now on."""
        mark = None if type in ANSWERS else f"ask-{next(self._marks)}"
        request = ControlRequest({"type": type, **fields}, mark)
        self.waiting.append(request)
        return request

    def on_reply(self, reply: dict[str, Any]) -> ControlRequest | None:
        """Return the request that a reply ends, or None."""
        request = next((one for one in self.waiting if one.is_answered_by(reply)), None)
        if request is not None:
            self.waiting.remove(request)
            request.reply = reply
        return request

    def on_lost(self) -> None:
        """End requests of which nobody knows whether the service has taken them; others are sent again."""
        words = "the connection was lost before the service answered"
        for request in [one for one in self.waiting if one.is_sent and one.mark is not None]:
            self.waiting.remove(request)
            request.reply = {"type": "error", "code": "connection", "message": words}
