"""Base classes of messages, and types of their fields."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, BaseModel, BeforeValidator, ConfigDict

from realizer.protocol.streams import STREAMS

# Version of the protocol that `hello` and `welcome` name.
PROTOCOL = 1

# Type of a control message -> type of its answer; other messages have none.
ANSWERS: Mapping[str, str] = {
    "hello": "welcome",
    "subscribe": "subscribed",
    "save": "saved",
    "state": "state",
    "ping": "pong",
}

# Longest control message: a scene of a few thousand objects.
MAX_CONTROL = 256 * 1024  # bytes
# Longest content of a `save` message: a face as GLB in base64.
MAX_CONTENT = 12 * 2**20  # characters
# The highest rate of frames; ten times as fast as a film.
MAX_FPS = 240

# Larger floats skip whole numbers.
EXACT = 2**53


def _whole(value: object) -> object:
    """Convert 25.0 to 25, because some JSON writers have only floats."""
    if isinstance(value, float) and value.is_integer() and abs(value) < EXACT:
        return int(value)
    return value


# A whole number in a request. For one with bounds: Annotated[int, Field(...), WHOLE].
WHOLE = BeforeValidator(_whole)
Whole = Annotated[int, WHOLE]
# Times are rounded to microseconds.
Seconds = Annotated[float, AfterValidator(lambda time: round(time, 6))]
# mypy accepts only literals that are written out.
if TYPE_CHECKING:
    StreamName = str
    NumericStream = str
    Encoding = str
else:
    StreamName = Literal[tuple(STREAMS)]
    NumericStream = Literal[tuple(row.name for row in STREAMS.values() if row.numeric)]
    Encoding = Literal[tuple(sorted({name for row in STREAMS.values() for name in row.encodings}))]
Picture = Literal["jpeg", "png", "webp"]
# Format of pictures, the default first -> media type.
PICTURES: dict[str, str] = {"jpeg": "image/jpeg", "png": "image/png", "webp": "image/webp"}


class Message(BaseModel):
    """A request: without unknown fields, NaN, or `true` or "25" in place of numbers."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)


def examples(*messages: dict[str, Any]) -> ConfigDict:
    """Return a model configuration with examples for the documentation."""
    return ConfigDict(json_schema_extra={"examples": list(messages)})


class Reply(BaseModel):
    """A message of the service."""

    model_config = ConfigDict(frozen=True)

    def text(self) -> str:
        """Return the message as JSON without the fields that are None."""
        return self.model_dump_json(exclude_none=True)
