"""Frames to bytes and back: the binary header and payloads of the streams, and their JSON form."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from realizer.arrays import Float32, Int16, Int32
from realizer.errors import RealizerError

__all__ = ["FORGET", "VERSION", "FrameKind", "WireError", "WireFrame", "json_frame", "pack", "unpack"]

VERSION = 1
# u8 kind, u8 version, u16 flags, u32 frame, f64 time; little-endian. 16 bytes, so the payload stays aligned
# for a Float32Array or an Int32Array over the message.
HEADER = struct.Struct("<BBHId")
# On a sound packet: forget every sample from this packet's time on; what follows replaces it.
FORGET = 0x100


class WireError(RealizerError):
    """A binary message that is no frame of ours; the text says what was wanted and what came."""


class FrameKind(IntEnum):
    """The first byte of a binary message."""

    FAP = 1  # 68 int32, column = FAP - 1
    AU = 2  # float32, 0..1, columns as named by `subscribed`
    PICTURE = 3  # a JPEG
    SOUND = 4  # mono int16 PCM, 20 ms
    MESH = 5  # (n, 3) int16; vertex in metres = int16 x scale + offset, both in `subscribed`


@dataclass(frozen=True, slots=True)
class WireFrame:
    """One binary message taken apart; `character` is the index that `subscribed` told."""

    kind: FrameKind
    frame: int
    time: float
    payload: bytes
    character: int = 0
    forget: bool = False

    @property
    def values(self) -> Int32 | Float32 | Int16:
        """The payload as numbers: (68,) int32, (n,) float32, (samples,) int16 or (n, 3) int16.

        Raises:
            WireError: a picture has none.
        """
        match self.kind:
            case FrameKind.FAP:
                return np.frombuffer(self.payload, "<i4")
            case FrameKind.AU:
                return np.frombuffer(self.payload, "<f4")
            case FrameKind.SOUND:
                return np.frombuffer(self.payload, "<i2")
            case FrameKind.MESH:
                return np.frombuffer(self.payload, "<i2").reshape(-1, 3)
        raise WireError("a picture has no values: wanted a frame of FAPs, AUs, sound or a mesh")


def pack(
    kind: FrameKind,
    frame: int,
    time: float,
    payload: bytes,
    *,
    character: int = 0,
    forget: bool = False,
) -> bytes:
    """One binary message. `frame` counts from the session's start, `time` is seconds on its clock."""
    return HEADER.pack(kind, VERSION, (character & 0xFF) | (FORGET if forget else 0), frame, time) + payload


def unpack(message: bytes) -> WireFrame:
    """A binary message taken apart.

    Raises:
        WireError: too short, another version, or a kind that is not known.
    """
    if len(message) < HEADER.size:
        raise WireError(f"wanted a header of {HEADER.size} bytes, got {len(message)} bytes")
    kind, version, flags, frame, time = HEADER.unpack_from(message)
    if version != VERSION:
        raise WireError(f"wanted version {VERSION} of the frame header, got {version}")
    if kind not in FrameKind.__members__.values():
        raise WireError(f"wanted a kind in {[int(k) for k in FrameKind]}, got {kind}")
    return WireFrame(FrameKind(kind), frame, time, message[HEADER.size :], flags & 0xFF, bool(flags & FORGET))


def json_frame(
    stream: str, frame: int, time: float, values: list[int] | list[float], character: str | None = None
) -> str:
    """One frame as a text message, such as `{"type":"fap","frame":3,"time":0.12,"values":[...]}`."""
    message = {"type": stream, "frame": frame, "time": round(time, 6), "values": values}
    if character is not None:
        message["character"] = character
    return json.dumps(message, separators=(",", ":"))
