"""Binary and JSON encoding of stream frames."""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, Float64, Int16, Int32
from realizer.core.errors import RealizerError
from realizer.protocol.streams import KINDS, STREAMS

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
class WireFrame:
    """A decoded binary message.

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
    def values(self) -> Int32 | Float32 | Int16:
        """The payload as numbers: (68,) int32, (n,) or (59,) float32, (samples,) int16 or (n, 3) int16.

        Raises:
            WireError: the payload is a picture.
        """
        row = KINDS[self.kind]
        if row.dtype is None:
            raise WireError("a picture has no values: wanted a frame of numbers")
        values: Int32 | Float32 | Int16 = np.frombuffer(self.payload, row.dtype)
        return values if row.width == 1 else values.reshape(-1, row.width)

    def rows(self) -> list[WireFrame]:
        """Split a message of a subscription with `ahead` into frames of one row; others are one frame."""
        info = self.stream_info
        if not info or not info.get("ahead"):
            return [self]
        size = len(info["names"]) * np.dtype(KINDS[self.kind].dtype).itemsize
        return [
            WireFrame(
                self.kind, k, k / info["fps"], self.payload[at : at + size], self.character, stream_info=info
            )
            for k, at in enumerate(range(0, len(self.payload), size), self.frame)
        ]

    @property
    def vertices(self) -> Float32:
        """The vertices of a mesh, (n, 3) float32 in metres.

        Raises:
            WireError: it is no mesh, or its scale is unknown.
        """
        if self.stream != "mesh" or self.stream_info is None:
            raise WireError(f"wanted a mesh whose scale is known, got {self.stream}")
        scale, offset = self.stream_info["scale"], self.stream_info["offset"]
        return (self.values * np.float32(scale) + np.array(offset, np.float32)).astype(np.float32)


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
        first: number of the first frame; the others follow it.
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


def unpack(message: bytes) -> WireFrame:
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
    return WireFrame(kind, frame, time, message[HEADER.size :], flags & 0xFF, bool(flags & FLUSH))


@dataclass(frozen=True, slots=True)
class ClipPiece:
    """A piece of a sound clip from a client: kind 4, like outgoing sound.

    Attributes:
        id: id of the clip.
        number: 0, 1, 2, ...: the header's `frame`; 0 begins the clip anew.
        rate: Hz of raw mono int16 PCM; 0 if the pieces together are a sound file.
        sound: its bytes.
        final: whether it is the last piece.
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
