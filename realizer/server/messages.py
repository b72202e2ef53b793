"""Control messages: JSON text in gives a model, or the error to answer with; replies go out as JSON."""

from __future__ import annotations

import json
from typing import Annotated, Any, Literal

from pydantic import (
    AliasChoices,
    BaseModel,
    ConfigDict,
    Field,
    TypeAdapter,
    ValidationError,
    field_validator,
    model_validator,
)

__all__ = [
    "MAX_APPEND",
    "STREAMS",
    "SUPPORTED",
    "Anticipate",
    "CharacterMessage",
    "Control",
    "ErrorMessage",
    "Gap",
    "Hello",
    "Ping",
    "Pong",
    "SceneMessage",
    "SetMessage",
    "SpeechMessage",
    "StateMessage",
    "StateQuery",
    "Stop",
    "Subscribe",
    "Subscribed",
    "Timed",
    "Unsubscribe",
    "Welcome",
    "parse_control",
]

# Version of the protocol that `hello` and `welcome` name.
PROTOCOL = 1
# Longest control message: a scene of a few thousand objects.
MAX_CONTROL = 256 * 1024  # bytes

# Longest text of one `speech` message; a speech may have any number of them.
MAX_APPEND = 20_000  # characters

Stream = Literal["feedback", "fap", "au", "mesh", "audio", "video", "schedule"]
FeedbackElement = Literal["blockProgress", "syncPointProgress", "predictionFeedback", "warningFeedback"]
# stream -> the encodings it has, the default first.
STREAMS: dict[str, tuple[str, ...]] = {
    "feedback": ("text",),
    "fap": ("binary", "json"),
    "au": ("binary", "json"),
    "mesh": ("binary",),
    "audio": ("binary",),
    "video": ("binary",),
    "schedule": ("json",),
}


class Message(BaseModel):
    """What all messages share: no unknown fields, no NaN."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class Hello(Message):
    """Says who is there; asks for `welcome`, and for the feedback after `seen` of a named session."""

    type: Literal["hello"]
    version: int = PROTOCOL
    session: str | None = Field(None, pattern=r"^[A-Za-z0-9._~-]{1,64}$")
    seen: int | None = Field(None, ge=0, description="seq of the last feedback that arrived")
    token: str | None = Field(None, max_length=4096, description="accepted; this service asks for none")


class Subscribe(Message):
    """Asks for a stream; answered by `subscribed`. The same stream of the same character is replaced.

    Every connection gets all feedback until it asks for some of it.
    """

    type: Literal["subscribe"]
    stream: Stream
    encoding: Literal["binary", "json", "text"] | None = None
    fps: float | None = Field(None, gt=0, le=240, description="None: the service's own rate")
    character: str | None = Field(None, max_length=256)
    size: tuple[int, int] = Field((512, 512), description="video: width, height in pixels")
    camera: str | None = Field(None, max_length=64, description="video; None: the service's own")
    light: str | None = Field(None, max_length=64, description="video; None: the service's own")
    background: str | None = Field(
        None, pattern="^#[0-9a-fA-F]{6}$", description="video: a colour; None: the service's, or the light's"
    )
    quality: int = Field(85, ge=1, le=100, description="video: of the JPEG")
    asked: bool = Field(False, description="au: as asked for, before the rules of co-occurrence")
    elements: list[FeedbackElement] | None = Field(None, description="feedback: which; none named is all")
    rate: int = Field(22050, ge=8000, le=48000, multiple_of=50, description="audio: samples a second")


class Unsubscribe(Message):
    """Ends a stream."""

    type: Literal["unsubscribe"]
    stream: Stream
    character: str | None = Field(None, max_length=256)


class Point(Message):
    """Metres: origin between the eyes, +x the character's left, +y up, +z forward."""

    x: float = Field(ge=-1e4, le=1e4)
    y: float = Field(ge=-1e4, le=1e4)
    z: float = Field(ge=-1e4, le=1e4)


class SceneMessage(Message):
    """Declares where targets are; None forgets the scene.

    Objects come as {name: {x, y, z}}, {name: [x, y, z]} or [{id, x, y, z}].
    """

    type: Literal["scene"]
    objects: dict[str, Point] | None = Field(max_length=10_000)

    @field_validator("objects", mode="before")
    @classmethod
    def _named(cls, value: Any) -> Any:
        if isinstance(value, list) and all(isinstance(o, dict) and ("id" in o or "name" in o) for o in value):
            value = {
                str(o.get("id", o.get("name"))): {k: v for k, v in o.items() if k not in ("id", "name")}
                for o in value
            }
        if isinstance(value, dict):
            return {
                name: dict(zip("xyz", point, strict=True))
                if isinstance(point, list) and len(point) == 3
                else point
                for name, point in value.items()
            }
        return value


class CharacterMessage(Message):
    """Gives a character its face and its voice."""

    type: Literal["character"]
    id: str | None = Field(None, min_length=1, max_length=256, description="none: the first")
    face: str | None = Field(None, max_length=64)
    voice: str | None = Field(None, max_length=64)


class Feeling(Message):
    """An emotion: its word, its place on the wheel, or its place in the plane of valence and arousal."""

    name: str | None = Field(None, min_length=1, max_length=64, description="a word, such as guilty")
    angle: float | None = Field(None, description="degrees on the wheel; turns do not count")
    activation: float | None = Field(None, description="0..7, with an angle; none: the rim's")
    valence: float | None = Field(None, description="-1..1, with arousal")
    arousal: float | None = Field(None, description="-1..1")
    intensity: float = Field(1.0, ge=0, le=1)


class SetMessage(Message):
    """Holds an emotion, AUs (0..1) and FAPs (FAPU) until told otherwise; null lets go.

    The emotion lies below, AUs refine it, FAPs come on top, whatever is sent first (Paul 2010, 7.4): an AU
    that is set is what it is set to, and so is a FAP, whatever AUs and speech ask of it.
    """

    type: Literal["set"]
    emotion: Feeling | None = None
    aus: dict[str, Annotated[float, Field(ge=0, le=1)] | None] = Field(
        {}, validation_alias=AliasChoices("aus", "au"), description='"12" or "12L"'
    )
    faps: dict[str, Annotated[float, Field(ge=-1e6, le=1e6)] | None] = Field(
        {}, validation_alias=AliasChoices("faps", "fap"), description="name or number"
    )
    character: str | None = Field(None, max_length=256)


SyncName = Annotated[str, Field(pattern=r"^[^\s:]{1,256}$")]


class Anticipate(Message):
    """Says when points in time are expected that behaviours are tied to, as `anticipators:id:sync`.

    It may be sent again and again while the estimate moves; what has not passed follows.
    """

    type: Literal["anticipate"]
    id: str = Field(min_length=1, max_length=256, pattern=r"^[^\s:]+$")
    syncs: dict[SyncName, Annotated[float, Field(ge=0, le=1e9)]] = Field(
        max_length=1000, description="name -> seconds on the session clock"
    )


class Timed(Message):
    """A word, a phoneme or a viseme of a clip, and when it is said."""

    start: float = Field(ge=0, le=1e5, description="seconds from the start of the clip")
    end: float | None = Field(None, ge=0, le=1e5, description="none: up to the next one")
    text: str = Field(
        max_length=256,
        validation_alias=AliasChoices("text", "word", "ipa", "phoneme", "viseme"),
        description='the word, the IPA, or the viseme\'s name in its set; a phoneme "" is a pause',
    )

    @field_validator("text", mode="before")
    @classmethod
    def _named(cls, value: Any) -> Any:
        return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


class SpeechMessage(Message):
    """Says something piece by piece, as text or clips come; or, without `id`, tells what is in a clip.

    Text may have <sync id="m"/>, SSML and behaviours in it; a sentence is spoken when it is whole. The speech
    is block `id`, from its first sound to its last; its pieces are the blocks `id.1`, `id.2`, ..., each with
    the behaviour `id`, whose syncs are those of the text. Without `close` the block goes on for ever.

    A clip comes as binary messages, little-endian: u8 kind 4, u8 version 1, u16 flags (0x200: the last
    piece), u32 number of the piece, f64 0, u32 rate in Hz of raw mono int16 PCM (0: the pieces are a WAV,
    FLAC, Ogg, MP3 or WebM file), u8 length of the id, the id, sound. Documents name it as a file: `clip:ID`.
    """

    type: Literal["speech"]
    id: str | None = Field(None, pattern=r"^[A-Za-z_][A-Za-z0-9_-]{0,63}$")
    append: str | None = Field(None, max_length=MAX_APPEND, description="text, with what may be in it")
    close: bool = Field(False, description="nothing follows: what is left is said, then the block ends")
    composition: Literal["MERGE", "APPEND", "REPLACE"] = Field(
        "APPEND", description="of the block, with its first message"
    )
    character: str | None = Field(None, max_length=256, description="with its first message")
    language: str | None = Field(None, max_length=64, description="BCP-47 of the text; none: the service's")
    clip: str | None = Field(None, min_length=1, max_length=64, description="of which the rest tells")
    text: str | None = Field(None, max_length=MAX_APPEND, description="plain: what is said in the clip")
    words: list[Timed] = Field([], max_length=MAX_APPEND)
    phonemes: list[Timed] = Field([], max_length=MAX_APPEND, description="in IPA")
    visemes: list[Timed] = Field([], max_length=MAX_APPEND, description="instead of phonemes")
    viseme_set: str = Field("oculus", max_length=64, description="of visemes: mpeg4, oculus, sapi or polly")
    final: bool = Field(True, description="all of the clip's times are told")

    @model_validator(mode="after")
    def _whole(self) -> SpeechMessage:
        if self.id is None and self.clip is None:
            raise ValueError("wanted the id of a speech, or a clip")
        if self.id is None and (self.append is not None or self.close):
            raise ValueError("wanted the id of the speech that is appended to or closed")
        if self.clip is None and (self.text is not None or self.words or self.phonemes or self.visemes):
            raise ValueError("wanted the clip that this is said in")
        if self.phonemes and self.visemes:
            raise ValueError("wanted phonemes or visemes, got both")
        return self


class Stop(Message):
    """Ends blocks gracefully: those named, or all."""

    type: Literal["stop"]
    blocks: list[str] | None = None


class StateQuery(Message):
    """Asks for `state`."""

    type: Literal["state"]


class Ping(Message):
    """Asks for `pong`, which carries the session's time."""

    type: Literal["ping"]
    id: int | str | None = None


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


class Reply(BaseModel):
    """A message out."""

    model_config = ConfigDict(frozen=True)

    def text(self) -> str:
        """As it goes over the wire; fields that are None are left out."""
        return self.model_dump_json(exclude_none=True)


class Welcome(Reply):
    """The answer to `hello`."""

    type: Literal["welcome"] = "welcome"
    version: int = PROTOCOL
    session: str
    time: float = Field(description="seconds on the session clock")
    seq: int = Field(description="seq of the newest feedback, 0 where there is none")
    capabilities: dict[str, Any]
    limits: dict[str, float]


class Subscribed(Reply):
    """A stream runs from `frame` on; what its values mean."""

    type: Literal["subscribed"] = "subscribed"
    stream: str
    encoding: str
    character: str | None = None
    index: int = Field(0, description="the low byte of the flags of binary frames")
    fps: float | None = None
    frame: int | None = None
    names: list[str] | None = Field(None, description="fap and au: one a value")
    face: str | None = Field(None, description="mesh and video; the rest mesh is at /faces/NAME")
    vertices: int | None = None
    scale: float | None = Field(None, description="mesh: metres = int16 x scale + offset")
    offset: list[float] | None = None
    rate: int | None = Field(None, description="audio: samples a second")
    size: list[int] | None = None
    media_type: str | None = None
    elements: list[str] | None = Field(None, description="feedback: which of it comes")


class StateMessage(Reply):
    """What plays, what waits, which AUs are up."""

    type: Literal["state"] = "state"
    session: str
    time: float
    blocks: list[dict[str, Any]]
    characters: list[dict[str, Any]]
    voice: dict[str, Any]
    connections: int
    dropped: int = Field(description="frames this connection was too slow for")


class ErrorMessage(Reply):
    """Why a control message was not followed. It changes nothing else."""

    type: Literal["error"] = "error"
    code: str
    message: str
    where: str | None = None


class Gap(Reply):
    """Feedback after `seen` is no longer (or was never) there; the next one is `first`."""

    type: Literal["gap"] = "gap"
    seen: int
    first: int


class Pong(Reply):
    """The answer to `ping`."""

    type: Literal["pong"] = "pong"
    id: int | str | None = None
    time: float = Field(description="seconds on the session clock")


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
