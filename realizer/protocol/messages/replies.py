"""Messages of the service: answers, and frames in JSON form."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from realizer.protocol.messages.common import PROTOCOL, NumericStream, Reply, Seconds


class Capabilities(Reply):
    """What there is to ask for."""

    streams: dict[str, list[str]] = Field(description="stream -> its encodings, the default first")
    pictures: list[str] = Field(description="formats of the stream video, the default first")
    fps: float = Field(description="frames a second of streams that name no rate")
    behaviours: list[str] = Field([], description="elements a block may hold")
    lexemes: dict[str, list[str]] = Field({}, description="element -> its lexemes")
    emotions: list[str] = Field([], description="words of `realizer:emotion`, `realizer:mood` and `set`")
    expressions: list[str] = Field([], description="names of `realizer:expression`")
    aus: list[str] = Field([], description="names of action units, L and R the sides")
    faces: list[str] = Field([], description="names, as `character` takes them")
    voices: list[str] = Field([], description="names of those that can speak here")
    cameras: list[str] = Field([], description="names, as `subscribe` takes them")
    lights: list[str] = Field([], description="names, as `subscribe` takes them")


class Limits(Reply):
    """What is too much."""

    message: int = Field(description="bytes of a WebSocket message")
    document: int = Field(description="bytes of a document")
    control: int = Field(description="bytes of a control message")
    elements: int = Field(description="in a message")
    behaviours: int = Field(description="in a block")
    duration: float = Field(description="seconds that a block may last")
    speech: int = Field(description="characters of one speech")
    blocks: int = Field(description="that play or wait in a session")
    characters: int = Field(description="in a session")
    connections: int = Field(description="from one address")
    rate: float = Field(description="messages a second that are read from a connection")
    picture: int = Field(description="pixels of a longer side")
    pixels: float = Field(
        description="pixels a second of the pictures of a session, each of which counts once"
    )
    fps: float = Field(description="frames a second")
    keep: float = Field(description="seconds a named session outlives its connections")


class Welcome(Reply):
    """The answer to `hello`."""

    type: Literal["welcome"] = "welcome"
    version: int = PROTOCOL
    session: str
    time: Seconds = Field(description="seconds on the session clock")
    seq: int = Field(description="seq of the newest feedback, 0 where there is none")
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
    names: list[str] | None = Field(None, description="fap, au and arkit: one a value")
    face: str | None = Field(None, description="mesh and video; the rest mesh is at /faces/NAME")
    vertices: int | None = None
    scale: float | None = Field(None, description="mesh: metres = int16 x scale + offset")
    offset: list[float] | None = None
    rate: int | None = Field(None, description="audio: samples a second")
    size: list[int] | None = None
    view: str | None = Field(None, description="video: as `subscribe` named it; its `index` is its own")
    media_type: str | None = None
    elements: list[str] | None = Field(None, description="feedback: which of it comes")


class FaceChanged(Reply):
    """A character of a `mesh` has another face; the fields describe the values from `frame` on."""

    type: Literal["changed"] = "changed"
    stream: str
    character: str | None = Field(None, description="as `subscribe` named it")
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
    behaviours: list[str] | None = Field(None, description="ids of those that have begun and not ended")


class LayerState(Reply):
    """What one layer asks of a face."""

    aus: dict[str, float] = Field({}, description="0..1")
    faps: dict[str, float] = Field({}, description="FAPU; those that do not come from action units")


class CharacterState(Reply):
    """A face as it is now."""

    character: str | None = None
    face: str
    voice: str | None = Field(None, description="none: the service's")
    aus: dict[str, float] = Field(description="what shows, 0..1; those that are 0 are left out")
    layers: dict[str, LayerState] = Field(
        {}, description="base, idle, expression, gaze, head, speech, faps, direct: what each asks for"
    )


class VoiceState(Reply):
    """The service's voice."""

    name: str | None = None
    fault: str | None = Field(None, description="why the silent voice stood in for it")


class StateMessage(Reply):
    """The blocks that play or wait, and the values of AUs with the layers that they come from."""

    type: Literal["state"] = "state"
    session: str
    time: Seconds
    blocks: list[BlockState]
    characters: list[CharacterState]
    voice: VoiceState
    connections: int = Field(description="how many share the session")
    dropped: int = Field(description="frames this connection was too slow for")


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
    """A control message was refused, for this reason, and has changed nothing."""

    type: Literal["error"] = "error"
    code: ErrorCode
    message: str = Field(description="what was wanted and what came")
    where: str | None = Field(None, description="message type and field")
    id: str | None = Field(None, description="of the speech whose message it was")


class Gap(Reply):
    """Feedback after `seen` is not stored any more (or never was); the next one is `first`."""

    type: Literal["gap"] = "gap"
    seen: int
    first: int


class Pong(Reply):
    """The answer to `ping`."""

    type: Literal["pong"] = "pong"
    id: int | str | None = None
    time: Seconds = Field(description="seconds on the session clock")


class FrameMessage(Reply):
    """A frame of the stream that `type` names, in the encoding JSON."""

    type: NumericStream
    frame: int = Field(description="k: sampled at k / fps of the session clock")
    time: float = Field(description="seconds on the session clock")
    values: list[float] = Field(description="one for each of the names that `subscribed` told")
    character: str | None = None


class ScheduleMessage(Reply):
    """The schedules of blocks: first of all that play or wait, then of those that change."""

    type: Literal["schedule"]
    time: float = Field(description="seconds on the session clock")
    whole: bool = Field(description="these are all blocks")
    blocks: list[dict[str, Any]] = Field(description="state, start, end; sync points, gaps and links")
    character: str | None = None
