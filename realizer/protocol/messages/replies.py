"""Models of the messages that the service sends as JSON."""

from typing import Any, Literal

from pydantic import Field

from realizer.protocol.messages.common import PROTOCOL, NumericStream, Reply, Seconds


class Capabilities(Reply):
    """What the service offers: streams, and the names that documents and messages can use."""

    streams: dict[str, list[str]] = Field(description="name of a stream -> its encodings, the default first")
    pictures: list[str] = Field(description="picture formats of the stream video, the default first")
    fps: float = Field(description="default frames per second of a stream")
    behaviours: list[str] = Field([], description="behaviour elements that a block may contain")
    lexemes: dict[str, list[str]] = Field({}, description="behaviour element -> its lexemes")
    emotions: list[str] = Field(
        [], description="emotion words for `realizer:emotion`, `realizer:mood` and `set`"
    )
    expressions: list[str] = Field([], description="names of expressions for `realizer:expression`")
    aus: list[str] = Field([], description="names of action units; L or R marks one side")
    faces: list[str] = Field([], description="names of faces for `character`")
    voices: list[str] = Field([], description="names of the installed voices")
    cameras: list[str] = Field([], description="names of cameras for `subscribe`")
    lights: list[str] = Field([], description="names of lights for `subscribe`")
    edit: bool = Field(False, description="whether this connection may `save`")
    corpus: bool = Field(False, description="whether there is a corpus whose recordings can be labelled")


class Limits(Reply):
    """The largest values that the service accepts."""

    message: int = Field(description="bytes of a WebSocket message")
    document: int = Field(description="bytes of BML in a message")
    control: int = Field(description="bytes of a control message")
    content: int = Field(description="characters of the content of a `save` message")
    elements: int = Field(description="XML elements in a message")
    behaviours: int = Field(description="behaviours in a block")
    duration: float = Field(description="duration of a block in seconds")
    speech: int = Field(description="characters of one speech")
    blocks: int = Field(description="blocks of a session that play or wait")
    characters: int = Field(description="characters of a session")
    connections: int = Field(description="open connections of one address")
    rate: float = Field(description="messages per second from one connection")
    picture: int = Field(description="pixels of a picture's longer side")
    pixels: float = Field(
        description="pixels per second of all pictures of a session; a shared stream counts once"
    )
    fps: float = Field(description="frames per second")
    keep: float = Field(description="seconds that a named session lives after its last connection")


class Welcome(Reply):
    """The answer to `hello`."""

    type: Literal["welcome"] = "welcome"
    version: int = PROTOCOL
    session: str
    connection: int = Field(0, description="number of this connection, as in the feedback's `inUseFor`")
    time: Seconds = Field(description="seconds on the session clock")
    seq: int = Field(description="seq of the newest feedback, 0 before the first")
    capabilities: Capabilities
    limits: Limits


class Subscribed(Reply):
    """The answer to `subscribe`: the stream begins at `frame`, and the other fields describe its values."""

    type: Literal["subscribed"] = "subscribed"
    stream: str
    encoding: str
    character: str | None = None
    index: int = Field(0, description="the low byte of the flags of binary frames")
    fps: float | None = None
    frame: int | None = None
    ahead: float | None = Field(None, description="streams of numbers: as in `subscribe`, if it is above 0")
    names: list[str] | None = Field(None, description="streams of numbers: names of the values")
    face: str | None = Field(
        None, description="mesh and video: name of the face; GET /faces/NAME has its mesh"
    )
    vertices: int | None = None
    scale: float | None = Field(None, description="mesh: metres = int16 x scale + offset")
    offset: list[float] | None = None
    rate: int | None = Field(None, description="audio: samples per second")
    size: list[int] | None = None
    view: str | None = Field(
        None, description="video: the view in `subscribe`; each view has its own `index`"
    )
    media_type: str | None = None
    elements: list[str] | None = Field(None, description="feedback: names of the elements that are sent")


class FaceChanged(Reply):
    """The character of a `mesh` stream got another face; the fields describe the values from `frame` on."""

    type: Literal["changed"] = "changed"
    stream: str
    character: str | None = Field(None, description="the character in `subscribe`")
    index: int = Field(0, description="the low byte of the flags of binary frames")
    frame: int
    face: str = Field(description="name of the face; GET /faces/NAME has its mesh")
    vertices: int
    scale: float = Field(description="metres = int16 x scale + offset")
    offset: list[float]


class BlockState(Reply):
    """The state of a block that plays, waits or is being prepared."""

    id: str
    character: str | None = None
    status: str = Field(description="IN_PREP, PENDING, LURKING, IN_EXEC or SUBSIDING, as in feedback")
    start: Seconds | None = Field(None, description="seconds on the session clock")
    end: Seconds | None = None
    behaviours: list[str] | None = Field(None, description="ids of the running behaviours")
    waits_for: list[str] | None = Field(
        None, description="blocks, syncs of open speeches, and own speeches without sound, that it waits for"
    )


class LayerState(Reply):
    """The values that one layer contributes to a face."""

    aus: dict[str, float] = Field({}, description="0..1")
    faps: dict[str, float] = Field({}, description="FAPU; only FAPs that do not come from action units")


class CharacterState(Reply):
    """The present state of a character's face."""

    character: str | None = None
    face: str
    voice: str | None = Field(None, description="absent: the service's voice")
    aus: dict[str, float] = Field(description="visible values of action units, 0..1, without zeros")
    layers: dict[str, LayerState] = Field(
        {}, description="base, idle, expression, gaze, head, speech, faps or direct -> values of the layer"
    )


class VoiceState(Reply):
    """The service's voice."""

    name: str | None = None
    fault: str | None = Field(None, description="why the silent voice was last used instead")


class StateMessage(Reply):
    """The answer to `state`: the blocks that play or wait, and the present faces."""

    type: Literal["state"] = "state"
    session: str
    time: Seconds
    blocks: list[BlockState]
    characters: list[CharacterState]
    voice: VoiceState
    connections: int = Field(description="number of connections to the session")
    dropped: int = Field(description="frames that this connection missed because it was slow")


ErrorCode = Literal[
    "bad-json", "too-large", "unsupported", "invalid", "version", "clip", "face", "voice", "render", "rate",
    "token", "journal", "edit", "conflict", "internal",
]  # fmt: skip


class ErrorMessage(Reply):
    """The service refused a control message, which has changed nothing, except `stop` of several blocks."""

    type: Literal["error"] = "error"
    code: ErrorCode
    message: str = Field(description="what was wrong, and what was wanted")
    where: str | None = Field(None, description="message type and field")
    id: str | None = Field(None, description="id of the speech of a refused `speech` message")


class Tracked(Reply):
    """What a picture of `track` shows; the character shows it, too."""

    type: Literal["tracked"] = "tracked"
    character: str | None = None
    frame: int = Field(description="the number in the header of the picture")
    time: Seconds = Field(description="when it came, seconds on the session clock")
    face: bool = Field(description="whether there is a face")
    aus: dict[str, float] = Field({}, description="action units, 0..1")
    head: list[float] | None = Field(None, description="degrees of pitch (down), yaw (left) and roll (right)")
    emotion: str | None = None
    certainty: float | None = Field(None, description="of the emotion, 0..1")


class Saved(Reply):
    """The answer to `save`. If the file has changed since `version`, the error `conflict` is sent instead."""

    type: Literal["saved"] = "saved"
    kind: str
    name: str
    version: str = Field(description="of the file, for the next `save`")
    file: str = Field(description="path in the folder of the service's setting `edit`")


class Gap(Reply):
    """Feedback after `seen` is not available; the next element has the `seq` `first`."""

    type: Literal["gap"] = "gap"
    seen: int
    first: int


class Pong(Reply):
    """The answer to `ping`."""

    type: Literal["pong"] = "pong"
    id: int | str | None = None
    time: Seconds = Field(description="seconds on the session clock")


class FrameMessage(Reply):
    """One frame of the stream `type` in JSON; with `ahead`, this frame and those that follow it."""

    type: NumericStream
    frame: int = Field(description="number k of the frame, which shows the session clock's instant k / fps")
    time: float = Field(description="seconds on the session clock")
    values: list[float] | list[list[float]] = Field(
        description="in the order of `names` in `subscribed`; with `ahead` a list of such rows"
    )
    character: str | None = None
    flush: bool | None = Field(
        None, description="true: discard the rows from `frame` on that were sent before, the plan has changed"
    )


class ScheduleMessage(Reply):
    """Schedules of blocks: of all blocks in the first message, then of changed blocks."""

    type: Literal["schedule"]
    time: float = Field(description="seconds on the session clock")
    whole: bool = Field(description="whether `blocks` has all blocks that play or wait")
    blocks: list[dict[str, Any]] = Field(
        description="state, start, end, sync points, gaps and links of each block"
    )
    character: str | None = None
