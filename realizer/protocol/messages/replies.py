"""Messages of the service: answers, and frames in JSON form."""

from typing import Any, Literal

from pydantic import Field

from realizer.protocol.messages.common import PROTOCOL, NumericStream, Reply, Seconds


class Capabilities(Reply):
    """What the service offers: streams, and the names that documents and messages can use."""

    streams: dict[str, list[str]] = Field(description="stream -> its encodings, the default first")
    pictures: list[str] = Field(description="formats of the stream video, the default first")
    fps: float = Field(description="frames a second of streams that name no rate")
    behaviours: list[str] = Field([], description="elements that a block may contain")
    lexemes: dict[str, list[str]] = Field({}, description="element -> its lexemes")
    emotions: list[str] = Field([], description="words of `realizer:emotion`, `realizer:mood` and `set`")
    expressions: list[str] = Field([], description="names of `realizer:expression`")
    aus: list[str] = Field([], description="names of action units, with L or R for one side")
    faces: list[str] = Field([], description="names for `character`")
    voices: list[str] = Field([], description="names of the voices that are installed")
    cameras: list[str] = Field([], description="names for `subscribe`")
    lights: list[str] = Field([], description="names for `subscribe`")


class Limits(Reply):
    """The limits of the service."""

    message: int = Field(description="bytes of a WebSocket message")
    document: int = Field(description="bytes of a document")
    control: int = Field(description="bytes of a control message")
    elements: int = Field(description="in a message")
    behaviours: int = Field(description="in a block")
    duration: float = Field(description="seconds that a block may last")
    speech: int = Field(description="characters of one speech")
    blocks: int = Field(description="playing or waiting in a session")
    characters: int = Field(description="in a session")
    connections: int = Field(description="from one address")
    rate: float = Field(description="messages a second from one connection")
    picture: int = Field(description="pixels of a picture's longer side")
    pixels: float = Field(description="pixels a second of all pictures of a session; shared ones count once")
    fps: float = Field(description="frames a second")
    keep: float = Field(description="seconds a named session outlives its connections")


class Welcome(Reply):
    """The answer to `hello`."""

    type: Literal["welcome"] = "welcome"
    version: int = PROTOCOL
    session: str
    time: Seconds = Field(description="seconds on the session clock")
    seq: int = Field(description="seq of the newest feedback, 0 before the first")
    capabilities: Capabilities
    limits: Limits


class Subscribed(Reply):
    """A stream begins at `frame`; the fields describe its values."""

    type: Literal["subscribed"] = "subscribed"
    stream: str
    encoding: str
    character: str | None = None
    index: int = Field(0, description="the low byte of the flags of binary frames")
    fps: float | None = None
    frame: int | None = None
    names: list[str] | None = Field(None, description="fap, au and arkit: the names of the values")
    face: str | None = Field(None, description="mesh and video; the rest mesh is at /faces/NAME")
    vertices: int | None = None
    scale: float | None = Field(None, description="mesh: metres = int16 x scale + offset")
    offset: list[float] | None = None
    rate: int | None = Field(None, description="audio: samples a second")
    size: list[int] | None = None
    view: str | None = Field(None, description="video: the name in `subscribe`; each has its own `index`")
    media_type: str | None = None
    elements: list[str] | None = Field(None, description="feedback: the elements that are sent")


class FaceChanged(Reply):
    """A character of a `mesh` has another face; the fields describe the values from `frame` on."""

    type: Literal["changed"] = "changed"
    stream: str
    character: str | None = Field(None, description="the name in `subscribe`")
    index: int = Field(0, description="the low byte of the flags of binary frames")
    frame: int
    face: str = Field(description="the rest mesh is at /faces/NAME")
    vertices: int
    scale: float = Field(description="metres = int16 x scale + offset")
    offset: list[float]


class BlockState(Reply):
    """A block that plays, waits or is being prepared."""

    id: str
    character: str | None = None
    status: str = Field(description="IN_PREP, PENDING, LURKING, IN_EXEC or SUBSIDING, as in feedback")
    start: Seconds | None = Field(None, description="seconds on the session clock")
    end: Seconds | None = None
    behaviours: list[str] | None = Field(None, description="ids of the running behaviours")


class LayerState(Reply):
    """The values that one layer contributes to a face."""

    aus: dict[str, float] = Field({}, description="0..1")
    faps: dict[str, float] = Field({}, description="FAPU; only FAPs that do not come from action units")


class CharacterState(Reply):
    """The present state of a character's face."""

    character: str | None = None
    face: str
    voice: str | None = Field(None, description="default: the service's voice")
    aus: dict[str, float] = Field(description="the visible values, 0..1, without zeros")
    layers: dict[str, LayerState] = Field(
        {}, description="base, idle, expression, gaze, head, speech, faps, direct: the values of each"
    )


class VoiceState(Reply):
    """The service's voice."""

    name: str | None = None
    fault: str | None = Field(None, description="why the silent voice replaced it last")


class StateMessage(Reply):
    """The blocks that play or wait, and the values of AUs with the layers that they come from."""

    type: Literal["state"] = "state"
    session: str
    time: Seconds
    blocks: list[BlockState]
    characters: list[CharacterState]
    voice: VoiceState
    connections: int = Field(description="number of connections that share the session")
    dropped: int = Field(description="frames that this connection missed because it was slow")


ErrorCode = Literal[
    "bad-json",
    "too-large",
    "unsupported",
    "invalid",
    "version",
    "clip",
    "face",
    "voice",
    "render",
    "rate",
    "token",
    "journal",
]


class ErrorMessage(Reply):
    """A control message was refused and has changed nothing."""

    type: Literal["error"] = "error"
    code: ErrorCode
    message: str = Field(description="what was wanted and what came")
    where: str | None = Field(None, description="message type and field")
    id: str | None = Field(None, description="id of the speech, if the message was `speech`")


class Gap(Reply):
    """Feedback after `seen` is not stored any more, or never was; the next one is `first`."""

    type: Literal["gap"] = "gap"
    seen: int
    first: int


class Pong(Reply):
    """The answer to `ping`."""

    type: Literal["pong"] = "pong"
    id: int | str | None = None
    time: Seconds = Field(description="seconds on the session clock")


class FrameMessage(Reply):
    """A frame of the stream `type` in the encoding JSON."""

    type: NumericStream
    frame: int = Field(description="k: sampled at k / fps of the session clock")
    time: float = Field(description="seconds on the session clock")
    values: list[float] = Field(description="in the order of `names` in `subscribed`")
    character: str | None = None


class ScheduleMessage(Reply):
    """Schedules of blocks: first of all that play or wait, then of those that change."""

    type: Literal["schedule"]
    time: float = Field(description="seconds on the session clock")
    whole: bool = Field(description="whether these are all blocks")
    blocks: list[dict[str, Any]] = Field(description="state, start, end; sync points, gaps and links")
    character: str | None = None
