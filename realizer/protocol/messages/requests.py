"""Control messages of clients."""

from typing import Annotated, Any, Literal

from pydantic import AliasChoices, Field, field_validator

from realizer.protocol.messages.common import (
    MAX_CONTENT,
    MAX_FPS,
    PROTOCOL,
    WHOLE,
    Encoding,
    Message,
    Picture,
    StreamName,
    Whole,
    examples,
)
from realizer.protocol.messages.speech import SpeechMessage

FeedbackElement = Literal["blockProgress", "syncPointProgress", "predictionFeedback", "warningFeedback"]
Side = Annotated[int, Field(ge=16), WHOLE]
Numbered = Annotated[int, Field(ge=0), WHOLE]


class Hello(Message):
    """Introduce the client. The answers are `welcome` and, of a named session, the feedback after `seen`.

    If the version is another one, the only answer is an error with the code `version`, which names the
    version of the service, and nothing else changes.
    """

    model_config = examples({"type": "hello", "version": 1, "session": "show", "seen": 12})

    type: Literal["hello"]
    version: Whole = Field(PROTOCOL, description="of the client's protocol")
    session: str | None = Field(None, pattern=r"^[A-Za-z0-9._~-]{1,64}$")
    seen: Numbered | None = Field(None, description="seq of the last feedback received")
    token: str | None = Field(
        None, max_length=4096, description="access token, if the service needs one and none was sent before"
    )


class Subscribe(Message):
    """Start a stream. The answer is `subscribed`. The same stream of the same character is replaced.

    A connection can have any number of streams, and several videos of one character, each with a `view` of
    its own. Every connection gets all feedback until it asks for some of it.
    """

    model_config = examples(
        {"type": "subscribe", "stream": "fap", "encoding": "json", "fps": 25},
        {"type": "subscribe", "stream": "au", "ahead": 0.2},
        {"type": "subscribe", "stream": "video", "size": [640, 480], "format": "webp", "light": "evening"},
        {"type": "subscribe", "stream": "feedback", "elements": ["blockProgress"], "character": "Ada"},
    )

    type: Literal["subscribe"]
    stream: StreamName
    encoding: Encoding | None = Field(None, description="default: the stream's first")
    fps: float | None = Field(None, gt=0, le=MAX_FPS, description="default: the service's rate")
    character: str | None = Field(None, max_length=256, description="default: the first")
    ahead: float = Field(
        0.0,
        ge=0,
        le=2,
        description="streams of numbers: seconds; above 0 a message has several rows, up to that long early",
    )
    size: tuple[Side, Side] = Field((512, 512), strict=False, description="video: width, height in pixels")
    camera: str | None = Field(None, max_length=64, description="video: a camera; default: the service's")
    light: str | None = Field(None, max_length=64, description="video: a light; default: the service's")
    background: str | None = Field(
        None,
        pattern="^(#[0-9a-fA-F]{6}|transparent)$",
        description="video: a colour, or transparent (PNG, WebP); default: the service's, or the light's",
    )
    format: Picture = Field("jpeg", description="video: format of the pictures")
    view: str | None = Field(
        None, max_length=64, description="video: a name; views of different names run side by side"
    )
    quality: Whole = Field(85, ge=1, le=100, description="video: of JPEG and WebP")
    asked: bool = Field(False, description="au: the values before the rules of co-occurrence")
    elements: list[FeedbackElement] | None = Field(None, description="feedback: default: all elements")
    rate: Whole = Field(22050, ge=8000, le=48000, multiple_of=50, description="audio: samples a second")


class Unsubscribe(Message):
    """End a stream."""

    model_config = examples({"type": "unsubscribe", "stream": "fap"})

    type: Literal["unsubscribe"]
    stream: StreamName
    character: str | None = Field(None, max_length=256)
    view: str | None = Field(None, max_length=64, description="video: the name in `subscribe`")


class Point(Message):
    """Metres: origin between the eyes, +x the character's left, +y up, +z forward."""

    x: float = Field(ge=-1e4, le=1e4)
    y: float = Field(ge=-1e4, le=1e4)
    z: float = Field(ge=-1e4, le=1e4)


class SceneMessage(Message):
    """Declare the positions of targets; null removes them.

    Objects have the form {name: {x, y, z}}, {name: [x, y, z]} or [{id, x, y, z}].
    """

    model_config = examples({"type": "scene", "objects": {"cup": {"x": 0.2, "y": -0.1, "z": 0.5}}})

    type: Literal["scene"]
    objects: dict[str, Point] | None = Field(max_length=10_000)

    @field_validator("objects", mode="before")
    @classmethod
    def _named(cls, value: Any) -> Any:
        if isinstance(value, list) and all(isinstance(o, dict) and ("id" in o or "name" in o) for o in value):
            names = ("id", "name")
            value = {
                str(o.get("id", o.get("name"))): {k: v for k, v in o.items() if k not in names} for o in value
            }
        if not isinstance(value, dict):
            return value
        triples = {
            name: point for name, point in value.items() if isinstance(point, list) and len(point) == 3
        }
        return value | {name: dict(zip("xyz", point, strict=True)) for name, point in triples.items()}


class CharacterMessage(Message):
    """Set the face and the voice of a character."""

    model_config = examples({"type": "character", "id": "Ada", "face": "ada", "voice": "silent"})

    type: Literal["character"]
    id: str | None = Field(None, min_length=1, max_length=256, description="default: the first")
    face: str | None = Field(None, max_length=64)
    voice: str | None = Field(None, max_length=64)


class EmotionFields(Message):
    """An emotion: its word, its place on the wheel, or its place in the plane of valence and arousal."""

    name: str | None = Field(None, min_length=1, max_length=64, description="a word, such as guilty")
    angle: float | None = Field(None, description="degrees on the wheel, modulo 360")
    activation: float | None = Field(None, description="0..7, with an angle; default: that of the rim")
    valence: float | None = Field(None, description="-1..1, with arousal")
    arousal: float | None = Field(None, description="-1..1")
    intensity: float = Field(1.0, ge=0, le=1)


class SetMessage(Message):
    """Set an emotion, AUs (0..1) and FAPs (FAPU) until they are changed; null releases one of them, or all.

    AUs replace those of the emotion, and FAPs replace those of AUs and speech, in any order of messages
    (Paul 2010, 7.4).
    """

    model_config = examples(
        {"type": "set", "emotion": {"name": "joy"}, "aus": {"12L": 0.5}, "faps": {"open_jaw": 200}}
    )

    type: Literal["set"]
    emotion: EmotionFields | None = None
    aus: dict[str, Annotated[float, Field(ge=0, le=1)] | None] | None = Field(
        {}, validation_alias=AliasChoices("aus", "au"), description='"12" or "12L"'
    )
    faps: dict[str, Annotated[float, Field(ge=-1e6, le=1e6)] | None] | None = Field(
        {}, validation_alias=AliasChoices("faps", "fap"), description="name or number"
    )
    character: str | None = Field(None, max_length=256)


class Heard(Message):
    """Tell a listening character what another one says: it nods, raises its brows and smiles.

    It listens for a minute after each message with `speaking`, and shows that it has understood after one
    without. Sound of a clip with the id `heard:CHARACTER` does the same: a voice in it, its pauses, its end.
    """

    model_config = examples({"type": "heard", "character": "Ada", "speaking": True, "text": "Good morning,"})

    type: Literal["heard"]
    character: str | None = Field(None, max_length=256, description="the listener; default: the first")
    speaking: bool = Field(description="whether the other speaks now")
    text: str | None = Field(
        None, max_length=10_000, description="what the other has said since the last message"
    )


class Track(Message):
    """Drive a character by the face in pictures of this connection, as in a mirror.

    Pictures follow as binary messages: the header with kind 3, version 1 and a number of their own, then a
    JPEG, PNG or WebP file. Each one is answered by `tracked`, but for those that come while another one is
    looked at: of these, the newest is looked at next. Pictures are not kept.
    """

    model_config = examples({"type": "track", "character": "Ada", "fps": 20})

    type: Literal["track"]
    character: str | None = Field(None, max_length=256, description="default: the first")
    fps: float = Field(20.0, ge=0, le=60, description="most pictures a second; 0 ends it")


class Save(Message):
    """Save a file of the service, if its setting `edit` allows that. The answer is `saved`.

    A file that has changed since it was read is not replaced: the error has the code `conflict`.
    """

    model_config = examples(
        {"type": "save", "kind": "expression", "name": "smirk", "content": "aus = { 12L = 0.6 }"}
    )

    type: Literal["save"]
    kind: Literal["expression"] = Field(description="expression: its TOML, as in a folder of expressions")
    name: str = Field(pattern=r"^[a-z0-9][a-z0-9_-]{0,63}$", description="of the file, without its suffix")
    content: str = Field(max_length=MAX_CONTENT, description="of the file")
    encoding: Literal["text", "base64"] = Field("text", description="of `content`")
    version: str | None = Field(
        None, max_length=64, description="of the file that this replaces; absent: there is none of that name"
    )


SyncName = Annotated[str, Field(pattern=r"^[^\s:]{1,256}$")]


class Anticipate(Message):
    """Announce or move points in time that behaviours refer to as `anticipators:id:sync`.

    It may be sent again whenever the estimate changes; sync points that have not passed follow.
    """

    model_config = examples({"type": "anticipate", "id": "clock", "syncs": {"beat": 12.5}})

    type: Literal["anticipate"]
    id: str = Field(min_length=1, max_length=256, pattern=r"^[^\s:]+$")
    syncs: dict[SyncName, Annotated[float, Field(ge=0, le=1e9)]] = Field(
        max_length=1000, description="name -> seconds on the session clock"
    )


class Stop(Message):
    """End blocks gracefully: the listed ones, or all. An unknown one is an error; the others end."""

    model_config = examples({"type": "stop", "blocks": ["b"]})

    type: Literal["stop"]
    blocks: list[str] | None = None


class StateQuery(Message):
    """Request `state`."""

    model_config = examples({"type": "state"})

    type: Literal["state"]


class Ping(Message):
    """Request `pong`, which contains the time of the session."""

    model_config = examples({"type": "ping", "id": 1})

    type: Literal["ping"]
    id: Whole | str | None = None


Control = (
    Hello | Subscribe | Unsubscribe | SceneMessage | CharacterMessage | SetMessage | Heard | Track | Save
    | Anticipate | SpeechMessage | Stop | StateQuery | Ping
)  # fmt: skip
