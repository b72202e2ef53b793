"""Frames of a player's face, computed ahead in windows; a frame is a slice of its window."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from realizer.animation.arkit import ARKIT_NAMES, arkit
from realizer.animation.axis import AU_NAMES
from realizer.animation.fap.conversion import FapMapping, standard, to_fap
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses
from realizer.core.array_types import Float32, Int16, Int32
from realizer.playback.player import Player
from realizer.protocol.streams import STREAMS
from realizer.protocol.wire import json_frame, pack, pack_frames
from realizer.tables import faps

if TYPE_CHECKING:
    from realizer.face.model import Face

# Length of the frames computed in one call. 250 frames cost only 1.5 times as much as 25, but a longer window
# is discarded more often, when the plan changes.
WINDOW = 10.0  # s
# Meshes computed in one call; each costs as much as all frames of a window.
MESHES = 8
# Radians; they follow the 52 weights in a frame of the stream arkit.
TURNS = (
    *("headYaw", "headPitch", "headRoll"),
    *("leftEyeYaw", "leftEyePitch", "rightEyeYaw", "rightEyePitch"),
)
# Rounding of k / fps and of times converted between clocks that have run for days.
EPSILON = 1e-6  # s


@dataclass(frozen=True)
class FrameSource:
    """The source of a stream of numbers.

    Attributes:
        rows: (AUs, mapping to FAPs, whether AUs are wanted as they were before the rules of co-occurrence)
            -> (n, k) the values of n frames.
    """

    names: Callable[[], list[str]]  # returns the names of the values of a frame
    rows: Callable[[AUFrames, FapMapping, bool], Float32 | Int32]
    window: float = WINDOW  # seconds that are computed in one call


def _arkit_rows(frames: AUFrames, mapping: FapMapping, raw: bool) -> Float32:
    shown = arkit(frames, mapping)
    return np.concatenate([shown.weights, shown.head, shown.eyes.reshape(len(shown.times), 4)], axis=1)


SOURCES: Mapping[str, FrameSource] = {
    "fap": FrameSource(
        lambda: [row.name for row in faps()],
        lambda frames, mapping, raw: to_fap(frames, mapping).integers(),
    ),
    "au": FrameSource(
        lambda: list(AU_NAMES()),
        lambda frames, mapping, raw: frames.before_rules if raw else frames.aus,
    ),
    # Fitting 10 s would hold up the event loop for 10 ms.
    "arkit": FrameSource(lambda: [*ARKIT_NAMES(), *TURNS], _arkit_rows, window=2.0),
}


def first_frame_at(now: float, fps: float) -> int:
    """Return the number of the first frame that is not before `now`."""
    return math.ceil((now - EPSILON) * fps)


def last_frame_at(now: float, fps: float) -> int:
    """Return the number of the last frame that is not after `now`."""
    return math.floor((now + EPSILON) * fps)


class FrameWindow:
    """Frames `first` .. `first + count - 1` of a timeline; each stream of them is computed on first use."""

    def __init__(self, timeline: FrameTimeline, mapping: FapMapping, first: int, count: int) -> None:
        self.first = first
        self.end = first + count
        self._timeline = timeline
        self._mapping = mapping
        self._times = np.arange(first, self.end) / timeline.fps
        self._aus: AUFrames | None = None
        self._packed: dict[tuple[str, bool], tuple[bytes, int]] = {}
        self._rows: dict[tuple[str, bool], Float32 | Int32] = {}
        # (stream, encoding, raw, name) -> frame, or (first row, last row, flush), and its message
        self._latest: dict[tuple[str, str, bool, str | None], tuple[object, str | bytes]] = {}
        self._meshes: Int16 | None = None
        self._meshes_from = 0

    @property
    def aus(self) -> AUFrames:
        """The AUs of the frames, from which all streams are computed."""
        if self._aus is None:
            self._aus = self._timeline.player.frames(self._times, self._timeline.character)
        return self._aus

    def drop_source(self, subscriptions: Iterable[FrameSubscription] = ()) -> None:
        """Compute what the subscriptions need, and free the AUs, which are several times as large."""
        if self._aus is None:
            return
        for s in subscriptions:
            if s.stream == "mesh":
                _ = self.poses
            elif s.encoding == "binary" and not s.ahead:
                self._all_packed(s)
            else:
                self.rows(s, self.first, self.end)
        self._aus = None

    @cached_property
    def poses(self) -> Float32:
        """(n, k) float32, the values of the face's inputs."""
        return poses(self.aus, self._timeline.face().inputs, self._mapping)

    def message(self, subscription: FrameSubscription, frame: int) -> str | bytes:
        """Return the WebSocket message of a frame."""
        s = subscription
        if s.encoding == "binary" and s.stream != "mesh":
            data, size = self._all_packed(s)
            at = (frame - self.first) * size
            return data[at : at + size]
        return self._once(s, frame, lambda: self._encode(s, frame))

    def rows_message(
        self, subscription: FrameSubscription, first: int, last: int, *, flush: bool
    ) -> str | bytes:
        """Return the WebSocket message of the rows `first` .. `last` of a stream of numbers."""
        s = subscription

        def encode() -> str | bytes:
            rows, time = self.rows(s, first, last + 1), first / self._timeline.fps
            if s.encoding == "binary":
                data = rows.astype(STREAMS[s.stream].dtype, copy=False).tobytes()
                return pack(s.stream, first, time, data, character=s.index, flush=flush)
            return json_frame(s.stream, first, time, _listed(rows), s.name, flush=flush)

        return self._once(s, (first, last, flush), encode)

    def _once(self, s: FrameSubscription, span: object, encode: Callable[[], str | bytes]) -> str | bytes:
        """Return the message of a frame or of several rows, encoded once for all subscribers in turn."""
        key = (s.stream, s.encoding, s.raw, s.name)
        known, message = self._latest.get(key, (None, b""))
        if known != span:
            message = encode()
            self._latest[key] = (span, message)
        return message

    def rows(self, subscription: FrameSubscription, first: int, end: int) -> Float32 | Int32:
        """Return the values of the frames `first` .. `end - 1` of a stream of numbers, (n, k)."""
        key = (subscription.stream, subscription.raw)
        if (rows := self._rows.get(key)) is None:
            rows = self._rows[key] = SOURCES[key[0]].rows(self.aus, self._mapping, key[1])
        part: Float32 | Int32 = rows[first - self.first : end - self.first]
        return part

    def _all_packed(self, subscription: FrameSubscription) -> tuple[bytes, int]:
        """Return the binary messages of all frames of a stream of numbers, joined, and the length of one."""
        stream, raw = subscription.stream, subscription.raw
        if (stream, raw) not in self._packed:
            rows = SOURCES[stream].rows(self.aus, self._mapping, raw)
            self._packed[stream, raw] = pack_frames(
                stream, self.first, self._times, rows, character=subscription.index
            )
        return self._packed[stream, raw]

    def _encode(self, subscription: FrameSubscription, frame: int) -> str | bytes:
        """Return the message of a single frame: meshes, and all streams in JSON."""
        s, time = subscription, frame / self._timeline.fps
        if s.encoding == "binary":
            mesh = self.mesh(frame - self.first)
            return pack(s.stream, frame, time, mesh.tobytes(), character=s.index)
        return json_frame(s.stream, frame, time, _listed(self.rows(s, frame, frame + 1))[0], s.name)

    def mesh(self, row: int) -> Int16:
        """Return the (n_vertices, 3) int16 mesh of a frame; `row` counts from the window's first frame."""
        from realizer.face.deform import deform
        from realizer.face.surface import quantise

        if self._meshes is None or not 0 <= row - self._meshes_from < MESHES:
            face, self._meshes_from = self._timeline.face(), row - row % MESHES
            poses = self.poses[self._meshes_from : self._meshes_from + MESHES]
            self._meshes = np.ascontiguousarray(quantise(face, deform(face, poses)).astype("<i2"))
        mesh: Int16 = self._meshes[row - self._meshes_from]
        return mesh


class FrameTimeline:
    """The frames of one character at one rate, in windows that are discarded when the plan changes.

    Args:
        face: returns the face; called when the first mesh or pose is needed.
        mapping: returns the mapping from AUs to FAPs; called again when the face has changed.
    """

    def __init__(
        self,
        player: Player,
        character: int,
        fps: float,
        face: Callable[[], Face],
        mapping: Callable[[], FapMapping] = standard,
    ) -> None:
        self.player = player
        self.character = character
        self.fps = fps
        self.face = face
        self._find_mapping = mapping
        self._mapping: FapMapping | None = None
        self.latest_window: FrameWindow | None = None
        self._seconds = WINDOW
        self._version = -1
        self._face_changes = 0

    def limit_windows(self, streams: Iterable[str]) -> None:
        """Limit the windows from now on to the length that is right for all of these streams."""
        seconds = min([WINDOW, *(SOURCES[stream].window for stream in streams if stream in SOURCES)])
        if seconds != self._seconds:
            self._seconds, self.latest_window = seconds, None

    def window(self, first: int, last: int) -> FrameWindow:
        """Return a window that contains the frames first .. last, and its whole length after them."""
        window = self.latest_window
        # The frames may have changed since the window was computed.
        if window is None or self._version != self.version or first < window.first or last >= window.end:
            if self._mapping is None:
                self._mapping = self._find_mapping()
            count = math.ceil(self._seconds * self.fps) + last - first
            window = self.latest_window = FrameWindow(self, self._mapping, first, count)
            self._version = self.version
        return window

    @property
    def version(self) -> int:
        """Increases whenever frames change that may have been computed before."""
        return self.player.version + self._face_changes

    def invalidate(self) -> None:
        """Discard the window because the face has changed."""
        self.latest_window = self._mapping = None
        self._face_changes += 1


@dataclass(eq=False)
class FrameSubscription:
    """A subscription to a stream of numbers, or to mesh."""

    stream: str
    encoding: str
    timeline: FrameTimeline
    index: int
    name: str | None  # the character's name, if the client named it
    next: int
    raw: bool = False  # whether AUs are sent as they are before the rules of co-occurrence
    ahead: float = 0.0  # how long before their time rows are sent, in seconds


def _listed(rows: Float32 | Int32) -> list[list[int]] | list[list[float]]:
    return rows.tolist() if rows.dtype.kind == "i" else [[round(v, 4) for v in row] for row in rows.tolist()]
