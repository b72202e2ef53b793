"""JSON text in, a control message out, or the error to answer with."""

from __future__ import annotations

import json
from typing import Annotated

from pydantic import Field, TypeAdapter, ValidationError

from realizer.server.messages.common import MAX_CONTROL, STREAMS
from realizer.server.messages.replies import ErrorMessage
from realizer.server.messages.requests import (
    Anticipate,
    CharacterMessage,
    Hello,
    Ping,
    SceneMessage,
    SetMessage,
    StateQuery,
    Stop,
    Subscribe,
    Unsubscribe,
)
from realizer.server.messages.speech import SpeechMessage

__all__ = ["SUPPORTED", "Control", "parse_control"]

Control = (
    Hello
    | Subscribe
    | Unsubscribe
    | SceneMessage
    | CharacterMessage
    | SetMessage
    | Anticipate
    | SpeechMessage
    | Stop
    | StateQuery
    | Ping
)
SUPPORTED: tuple[str, ...] = (
    "hello",
    "subscribe",
    "unsubscribe",
    "scene",
    "character",
    "set",
    "anticipate",
    "speech",
    "stop",
    "state",
    "ping",
)
_ADAPTER: TypeAdapter[Control] = TypeAdapter(Annotated[Control, Field(discriminator="type")])


def parse_control(text: str) -> Control | ErrorMessage:
    """A control message, or the error to answer with: code bad-json, too-large, unsupported or invalid."""
    if len(text) > MAX_CONTROL:
        return ErrorMessage(
            code="too-large",
            message=f"wanted a control message of at most {MAX_CONTROL} bytes, got {len(text)}",
        )
    try:
        message = json.loads(text)
    except RecursionError:
        return ErrorMessage(code="bad-json", message="wanted a flat JSON object, got one nested too deeply")
    except ValueError as error:
        return ErrorMessage(code="bad-json", message=f"wanted a JSON object with a type: {error}")
    kind = message.get("type")
    if kind not in SUPPORTED:
        return ErrorMessage(
            code="unsupported",
            message=f"wanted a type of {', '.join(SUPPORTED)}; got {_short(kind)}",
            where="type",
        )
    if kind == "subscribe" and message.get("stream") not in tuple(STREAMS):
        return ErrorMessage(
            code="unsupported",
            message=f"wanted a stream of {', '.join(STREAMS)}; got {_short(message.get('stream'))}",
            where="subscribe.stream",
        )
    try:
        return _ADAPTER.validate_python(message)
    except ValidationError as error:
        first = error.errors(include_url=False, include_context=False)[0]
        where = ".".join(str(part) for part in first["loc"])
        said = first["msg"].removeprefix("Value error, ")
        return ErrorMessage(code="invalid", message=f"{said}; got {_short(first['input'])}", where=where)


def _short(value: object) -> str:
    text = json.dumps(value, default=str)
    return text if len(text) <= 80 else text[:77] + "..."
