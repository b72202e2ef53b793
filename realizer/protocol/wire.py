"""Binary and JSON encoding of stream frames."""

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from io import BytesIO
from typing import Any, Generic, Self, TypeVar

import numpy as np

from realizer.core.array_types import Float32, Float64, Int16, Int32, UInt8
from realizer.core.errors import RealizerError
from realizer.protocol.streams import KINDS, STREAMS

A = TypeVar("A")
VERSION = 1
# u8 kind, u8 version, u16 flags, u32 frame, f64 time; little-endian. 16 bytes, so the payload stays aligned
# for a Float32Array or an Int32Array over the message.
HEADER = struct.Struct("<BBHId")
# Flag of a sound packet, or of rows that are sent ahead: forget everything from the message's time on; this
# message and later ones replace it.
FLUSH = 0x100
# Flag of the last piece of a sound clip from a client.
FINAL = 0x200
# Behind the header of such a piece: u32 rate, u8 length of the id, the id (UTF-8), then sound.
CLIP = struct.Struct("<IB")


class WireError(RealizerError):
    """A binary message is invalid."""


@dataclass(frozen=True, slots=True)
class WireFrame(Generic[A]):
    """A decoded binary message. Some streams have a class of their own, with more than the numbers.

    Attributes:
        character: index of the character, as in `subscribed`.
        flush: whether to discard everything from this time on that was sent before.
        stream_info: the fields of the last `subscribed` or `changed` of its stream, added by the client.
    """

    kind: int
    frame: int
    time: float
    payload: bytes
    character: int = 0
    flush: bool = False
    stream_info: Mapping[str, Any] | None = field(default=None, compare=False, repr=False)

    @property
    def stream(self) -> str:
        """The name of its stream."""
        return KINDS[self.kind].name

    @property
    def values(self) -> A:
        """The payload as numbers.

        Raises:
            WireError: the payload is a picture.
        """
        row = KINDS[self.kind]
        if row.dtype is None:
            raise WireError("a picture has no values: wanted a frame of numbers")
        values: Any = np.frombuffer(self.payload, row.dtype)
        return values if row.width == 1 else values.reshape(-1, row.width)  # type: ignore[no-any-return]

    @property
    def named(self) -> dict[str, float]:
        """Name -> value, such as that of an action unit; {} for a mesh, a picture or sound."""
        names: Sequence[str] = (self.stream_info or {}).get("names", ())
        return dict(zip(names, np.asarray(self.values).tolist(), strict=False)) if names else {}

    def rows(self) -> list[Self]:
        """Split a message of a subscription with `ahead` into frames of one row; others are one frame."""
        info = self.stream_info
        if not info or not info.get("ahead"):
            return [self]
        size = len(info["names"]) * np.dtype(KINDS[self.kind].dtype).itemsize
        return [
            replace(self, frame=k, time=k / info["fps"], payload=self.payload[at : at + size], flush=False)
            for k, at in enumerate(range(0, len(self.payload), size), self.frame)
        ]


class FapFrame(WireFrame[Int32]):
    """MPEG-4's parameters: `values` are (68,) int32 in FAPU, column = FAP - 1."""


class AUFrame(WireFrame[Float32]):
    """Action units: `values` are (n,) float32, 0..1; `named` has their names."""


class ArkitFrame(WireFrame[Float32]):
    """ARKit's 52 weights, 0..1, then rotations of head and eyes: `values` are (59,) float32."""


class MeshFrame(WireFrame[Int16]):
    """The vertices of a face: `values` are (n, 3) int16 as sent, `vertices` are metres."""

    @property
    def vertices(self) -> Float32:
        """The vertices, (n, 3) float32 in metres.

        Raises:
            WireError: their scale is unknown.
        """
        if self.stream_info is None:
            raise WireError("wanted a mesh whose scale is known, got none of a subscription")
        scale, offset = self.stream_info["scale"], self.stream_info["offset"]
        return (self.values * np.float32(scale) + np.array(offset, np.float32)).astype(np.float32)


class PictureFrame(WireFrame[Any]):
    """A picture: `payload` is a JPEG, PNG or WebP file."""

    @property
    def pixels(self) -> UInt8:
        """The decoded picture, (h, w, 3) uint8, or (h, w, 4) if it is transparent."""
        from PIL import Image

        with Image.open(BytesIO(self.payload)) as picture:
            return np.asarray(picture.convert("RGBA" if picture.mode in ("RGBA", "LA", "P") else "RGB"))


class SoundFrame(WireFrame[Int16]):
    """20 ms of sound: `values` are mono samples, (n,) int16; `time` is that of the first one."""

    @property
    def rate(self) -> int:
        """Samples a second.

        Raises:
            WireError: the frame is none of a subscription.
        """
        if self.stream_info is None:
            raise WireError("wanted sound whose rate is known, got none of a subscription")
        return int(self.stream_info["rate"])


# Those of other streams are WireFrames.
_FRAMES: Mapping[str, type[WireFrame[Any]]] = {
    "fap": FapFrame, "au": AUFrame, "arkit": ArkitFrame,
    "mesh": MeshFrame, "video": PictureFrame, "audio": SoundFrame,
}  # fmt: skip


def pack(
    stream: str, frame: int, time: float, payload: bytes, *, character: int = 0, flush: bool = False
) -> bytes:
    """Encode a binary message. `frame` counts from the session's start, `time` is seconds on its clock."""
    kind = STREAMS[stream].kind
    return HEADER.pack(kind, VERSION, (character & 0xFF) | (FLUSH if flush else 0), frame, time) + payload


def pack_frames(
    stream: str, first: int, times: Float64, rows: Int32 | Float32, *, character: int = 0
) -> tuple[bytes, int]:
    """Encode many frames in one call. Return their messages, joined, and the length of one.

    Args:
        times: (n,) seconds.
        rows: (n, k) the payloads.
    """
    header = [("kind", "u1"), ("version", "u1"), ("flags", "<u2"), ("frame", "<u4"), ("time", "<f8")]
    messages = np.empty(len(rows), [*header, ("payload", rows.dtype.newbyteorder("<"), rows.shape[1:])])
    messages["kind"], messages["version"] = STREAMS[stream].kind, VERSION
    messages["flags"] = character & 0xFF
    messages["frame"] = np.arange(first, first + len(rows))
    messages["time"], messages["payload"] = times, rows
    return messages.tobytes(), messages.dtype.itemsize


def unpack(message: bytes) -> WireFrame[Any]:
    """Decode a binary message.

    Raises:
        WireError: it is too short, or its version or kind is unknown.
    """
    if len(message) < HEADER.size:
        raise WireError(f"wanted a header of {HEADER.size} bytes, got {len(message)} bytes")
    kind, version, flags, frame, time = HEADER.unpack_from(message)
    if version != VERSION:
        raise WireError(f"wanted version {VERSION} of the frame header, got {version}")
    if kind not in KINDS:
        raise WireError(f"wanted a kind in {list(KINDS)}, got {kind}")
    make = _FRAMES.get(KINDS[kind].name, WireFrame)
    return make(kind, frame, time, message[HEADER.size :], flags & 0xFF, bool(flags & FLUSH))


@dataclass(frozen=True, slots=True)
class ClipPiece:
    """A piece of a sound clip from a client: kind 4, like outgoing sound.

    Attributes:
        number: 0, 1, 2, ...: the header's `frame`; 0 begins the clip anew.
        rate: Hz of raw mono int16 PCM; 0 if the pieces together are a sound file.
    """

    id: str
    number: int
    rate: int
    sound: bytes
    final: bool = True


def pack_clip(piece: ClipPiece) -> bytes:
    """Encode a piece of a clip; the header's time is 0 and ignored."""
    flags, id = FINAL if piece.final else 0, piece.id.encode()
    head = HEADER.pack(STREAMS["audio"].kind, VERSION, flags, piece.number, 0.0)
    return head + CLIP.pack(piece.rate, len(id)) + id + piece.sound


def unpack_clip(message: bytes) -> ClipPiece:
    """Decode a piece of a clip.

    Raises:
        WireError: it is no piece of a sound clip.
    """
    frame = unpack(message)
    if frame.stream != "audio":
        raise WireError(f"wanted a sound clip (kind {STREAMS['audio'].kind}), got kind {frame.kind}")
    if len(frame.payload) < CLIP.size:
        raise WireError(f"wanted a rate and an id behind the header, got {len(frame.payload)} bytes")
    rate, length = CLIP.unpack_from(frame.payload)
    id, sound = frame.payload[CLIP.size : CLIP.size + length], frame.payload[CLIP.size + length :]
    if not 0 < length == len(id):
        raise WireError(f"wanted an id of {max(1, length)} bytes, got {len(id)}")
    try:
        name = id.decode()
    except UnicodeDecodeError:
        raise WireError(f"wanted an id in UTF-8, got {id!r}") from None
    final = bool(struct.unpack_from("<H", message, 2)[0] & FINAL)
    return ClipPiece(name, frame.frame, rate, sound, final)


def json_frame(
    stream: str,
    frame: int,
    time: float,
    values: list[int] | list[float] | list[list[int]] | list[list[float]],
    character: str | None = None,
    *,
    flush: bool = False,
) -> str:
    """Encode a frame as text, such as `{"type":"fap","frame":3,"time":0.12,"values":[...]}`.

    Args:
        values: of one frame, or a list of them: of this frame and those that follow it.
    """
    message = {"type": stream, "frame": frame, "time": round(time, 6), "values": values}
    if flush:
        message["flush"] = True
    if character is not None:
        message["character"] = character
    return json.dumps(message, separators=(",", ":"))
