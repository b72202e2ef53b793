"""Base classes of messages; protocol version, streams and encodings."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict

from realizer.protocol.streams import STREAMS

# Version of the protocol that `hello` and `welcome` name.
PROTOCOL = 1

# Type of a control message -> type of its answer; the others have none.
ANSWERS: Mapping[str, str] = {
    "hello": "welcome",
    "subscribe": "subscribed",
    "state": "state",
    "ping": "pong",
}

# Longest control message: a scene of a few thousand objects.
MAX_CONTROL = 256 * 1024  # bytes
# The highest rate of frames; ten times as fast as a film.
MAX_FPS = 240

# Beyond these a float skips numbers.
EXACT = 2**53


def _whole(value: object) -> object:
    """JSON has one kind of number, and what writes it may write 25 as 25.0."""
    if isinstance(value, float) and value.is_integer() and abs(value) < EXACT:
        return int(value)
    return value


# A whole number of a message in; and what makes one that has bounds of its own, given behind them.
WHOLE = BeforeValidator(_whole)
Whole = Annotated[int, WHOLE]
# Of a time no more is told than anybody can mean.
Seconds = Annotated[float, AfterValidator(lambda time: round(time, 6))]
# mypy takes no names for a Literal that are not written out.
if TYPE_CHECKING:
    StreamName = str
    NumericStream = str
    Encoding = str
else:
    StreamName = Literal[tuple(STREAMS)]
    NumericStream = Literal[tuple(row.name for row in STREAMS.values() if row.numeric)]
    Encoding = Literal[tuple(sorted({name for row in STREAMS.values() for name in row.encodings}))]
Picture = Literal["jpeg", "png", "webp"]
# What pictures of the stream `video` are, the default first -> their media type.
PICTURES: dict[str, str] = {"jpeg": "image/jpeg", "png": "image/png", "webp": "image/webp"}


class Message(BaseModel):
    """A message in: no unknown fields, no NaN, numbers that are numbers: neither `true` nor "25"."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)


class Reply(BaseModel):
    """A message out."""

    model_config = ConfigDict(frozen=True)

    def text(self) -> str:
        """As it goes over the wire; fields that are None are left out."""
        return self.model_dump_json(exclude_none=True)
