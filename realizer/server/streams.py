"""A player's face and sound, computed ahead: frame k of a rate and packet n of a sound are slices."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np

from realizer.animation.fap import to_fap
from realizer.animation.frames import AUFrames, FAPFrames
from realizer.animation.mapping import FapMapping, standard
from realizer.animation.pose import poses
from realizer.arrays import Float32, Float64, Int16, Int32
from realizer.outputs.arkit import ARKIT_NAMES, arkit
from realizer.player import Player, Speaking
from realizer.server.wire import FrameKind, json_frame, pack
from realizer.sound import CUT, heard

if TYPE_CHECKING:
    from realizer.face.model import Face

__all__: list[str] = []

# Frames computed in one call. 200 frames cost twice what 25 do; a longer window is thrown away more often,
# when a plan changes.
WINDOW = 8.0  # s
# Meshes computed in one call: each costs as much as the frames of a whole window, so a few at a time.
MESHES = 8
# A sound packet, and how far ahead of its time it is sent.
PACKET = 0.02  # s
AHEAD = 0.1  # s
# Sound is made in blocks of so many seconds, of which so many are kept.
BLOCK, BLOCKS = 4, 16
# What follows the 52 weights of a frame of the stream arkit, in radians.
TURNS = (
    *("headYaw", "headPitch", "headRoll"),
    *("leftEyeYaw", "leftEyePitch", "rightEyeYaw", "rightEyePitch"),
)
# Rounding of k / fps, and of times that go from one clock to another and back, on a clock of days.
EPSILON = 1e-6  # s


def first_at(now: float, fps: float) -> int:
    """The first frame whose time is not before `now`."""
    return math.ceil((now - EPSILON) * fps)


def last_at(now: float, fps: float) -> int:
    """The newest frame whose time has come."""
    return math.floor((now + EPSILON) * fps)


class Window:
    """Frames `first` .. `first + n - 1` of one character; each of its arrays is made when first asked for.

    Args:
        aus: (times) -> the AUs at those times.
    """

    def __init__(
        self,
        first: int,
        count: int,
        fps: float,
        aus: Callable[[Float64], AUFrames],
        face: Callable[[], Face],
        mapping: FapMapping,
    ) -> None:
        self.first = first
        self.count = count
        self.fps = fps
        self._make = aus
        self._aus: AUFrames | None = None
        self._face = face
        self._mapping = mapping
        self._meshes: Int16 | None = None
        self._meshes_from = 0

    @property
    def aus(self) -> AUFrames:
        """All that follows is made of these."""
        if self._aus is None:
            self._aus = self._make(np.arange(self.first, self.end) / self.fps)
        return self._aus

    def settle(self) -> None:
        """What is streamed has been made: let go of what it was made of, which is several times as large."""
        self._aus = None

    @property
    def end(self) -> int:
        return self.first + self.count

    @property
    def faps(self) -> FAPFrames:
        """In FAPU."""
        return to_fap(self.aus, self._mapping)

    @cached_property
    def integers(self) -> Int32:
        """(n, 68) int32."""
        return np.ascontiguousarray(self.faps.integers().astype("<i4"))

    @cached_property
    def intensities(self) -> Float32:
        """(n, n_au) float32, 0..1."""
        return np.ascontiguousarray(self.aus.aus.astype("<f4"))

    @cached_property
    def asked(self) -> Float32:
        """(n, n_au) float32, 0..1: as asked for, before the rules of co-occurrence."""
        return np.ascontiguousarray(self.aus.asked.astype("<f4"))

    @cached_property
    def arkit(self) -> Float32:
        """(n, 59) float32: the weights, 0..1, and `TURNS` in radians; columns as `arkit_names()`."""
        shown = arkit(self.aus, self._mapping)
        eyes = shown.eyes.reshape(len(shown.times), 4)
        return np.ascontiguousarray(np.concatenate([shown.weights, shown.head, eyes], axis=1).astype("<f4"))

    @cached_property
    def poses(self) -> Float32:
        """(n, k) float32: what the face is drawn by."""
        return poses(self.aus, self._face().takes, self._mapping)

    def mesh(self, row: int) -> Int16:
        """(n_vertices, 3) int16 of one frame, counted from the first."""
        from realizer.face import deform, quantise

        if self._meshes is None or not 0 <= row - self._meshes_from < MESHES:
            face, self._meshes_from = self._face(), row - row % MESHES
            poses = self.poses[self._meshes_from : self._meshes_from + MESHES]
            self._meshes = np.ascontiguousarray(quantise(face, deform(face, poses)).astype("<i2"))
        mesh: Int16 = self._meshes[row - self._meshes_from]
        return mesh


class Timeline:
    """One character at one rate: frames in windows, dropped when the player's plan changes.

    Args:
        face: what is drawn; called when the first mesh or pose is asked for.
        mapping: what its AUs ask of FAPs; called for each window.
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
        self._face = face
        self._mapping = mapping
        self._window: Window | None = None
        self._revision = -1

    def window(self, first: int, last: int) -> Window:
        """A window that holds frames first .. last, and more to come."""
        window = self._window
        if (
            window is None
            or self._revision != self.player.revision
            or first < window.first
            or last >= window.end
        ):
            count = max(math.ceil(WINDOW * self.fps), last - first + 1)

            def aus(times: Float64) -> AUFrames:
                return self.player.frames(times, self.character)

            window = self._window = Window(first, count, self.fps, aus, self._face, self._mapping())
            self._revision = self.player.revision
        return window

    def forget(self) -> None:
        """Compute anew what comes next: the face has changed."""
        self._window = None


class Wanted(Protocol):
    """What a subscription wants of a window."""

    stream: str
    encoding: str
    index: int
    name: str | None
    asked: bool


def arkit_names() -> list[str]:
    """What the values of a frame of the stream arkit are."""
    return [*ARKIT_NAMES(), *TURNS]


def encode(window: Window, wanted: Wanted, frame: int) -> str | bytes:
    """Frame `frame` of the window as one WebSocket message."""
    n, time = frame - window.first, frame / window.fps
    row: Float32 | Int32 | Int16
    match wanted.stream:
        case "fap":
            kind, row = FrameKind.FAP, window.integers[n]
        case "au":
            kind, row = FrameKind.AU, (window.asked if wanted.asked else window.intensities)[n]
        case "arkit":
            kind, row = FrameKind.ARKIT, window.arkit[n]
        case _:
            kind, row = FrameKind.MESH, window.mesh(n)
    if wanted.encoding == "json":
        values = [v if isinstance(v, int) else round(v, 4) for v in row.tolist()]
        return json_frame(wanted.stream, frame, time, values, wanted.name)
    return pack(kind, frame, time, row.tobytes(), character=wanted.index)


class Sound:
    """What a player says, in packets of 20 ms; packet n begins at n x 0.02 s on the session clock."""

    def __init__(self, player: Player, rate: int, character: int | None) -> None:
        self.player = player
        self.rate = rate
        self.character = character
        self._samples = round(PACKET * rate)
        self._cache: dict[tuple[int, int], tuple[Speaking, Float32]] = {}  # the latest at the end

    def speaking(self) -> list[Speaking]:
        """What sounds or will sound, in order of its start."""
        return [
            s
            for s in self.player.speech()
            if s.utterance.pcm is not None and self.character in (None, s.character)
        ]

    def span(self) -> tuple[float, float] | None:
        """(first, last) seconds of all that sounds or will sound; None where nothing does."""
        speaking = self.speaking()
        if not speaking:
            return None
        return min(s.start for s in speaking), max(_end(s) for s in speaking)

    def packet(self, number: int) -> bytes | None:
        """The PCM of one packet; None in silence."""
        first = number * self._samples
        mix: Float32 | None = None
        for speaking in self.speaking():
            if _end(speaking) * self.rate <= first or speaking.start * self.rate >= first + self._samples:
                continue
            offset = round(speaking.start * self.rate)
            piece = self._pcm(speaking, max(0, first - offset), max(0, first + self._samples - offset))
            if not len(piece):
                continue
            if mix is None:
                mix = np.zeros(self._samples, np.float32)
            at = max(0, offset - first)
            mix[at : at + len(piece)] += piece
        if mix is None:
            return None
        return np.clip(np.rint(mix), -32768, 32767).astype("<i2").tobytes()

    def _pcm(self, speaking: Speaking, first: int, last: int) -> Float32:
        """Samples first .. last of a speech at the stream's rate, as a film has it; fewer at its end."""
        size = BLOCK * self.rate
        blocks = [self._block(speaking, n) for n in range(first // size, -(-last // size))]
        whole = blocks[0] if len(blocks) == 1 else np.concatenate([np.zeros(0, np.float32), *blocks])
        begin = first // size * size
        return whole[first - begin : last - begin]

    def _block(self, speaking: Speaking, number: int) -> Float32:
        """`BLOCK` seconds of a speech: of one that lasts for minutes no more is made than is heard."""
        key = (id(speaking), number)
        known = self._cache.pop(key, None)
        if known is None or known[0] is not speaking:
            known = (speaking, self._made(speaking, number * BLOCK))
        self._cache[key] = known
        while len(self._cache) > BLOCKS:
            del self._cache[next(iter(self._cache))]
        return known[1]

    def _made(self, speaking: Speaking, second: int) -> Float32:
        utterance = speaking.utterance
        assert utterance.pcm is not None
        # A second more on either side, so that filters and fades are those of the whole.
        first, rate = max(0, second - 1), utterance.sample_rate
        pcm = utterance.pcm[first * rate : (second + BLOCK + 1) * rate]
        part = replace(utterance, pcm=pcm, duration=len(pcm) / rate)
        sound = heard(replace(speaking, start=speaking.start + first, utterance=part), self.rate)
        return sound[(second - first) * self.rate : (second - first + BLOCK) * self.rate]


def _end(speaking: Speaking) -> float:
    return min(speaking.start + speaking.utterance.duration, speaking.until + CUT)
