"""A session that is played again in, the frames of its faces out: each as those got it who were there."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from realizer.animation.fap import to_fap
from realizer.animation.frames import AUFrames, FAPFrames
from realizer.composition.playing import Playing
from realizer.mapping import mapping_of
from realizer.realization import Performance
from realizer.server.session import Session
from realizer.server.streams import EPSILON, Window, first_at

__all__ = ["Viewer"]


class Viewer:
    """Who looks at all faces of a session while time passes, and remembers what was to be seen.

    A session forgets what is past, as it did when it was live: what it held, which blocks there were.

    Args:
        fps: frames a second; frame k is sampled at k / fps.
        begin: seconds on the session clock, of the first frame or less than one behind it.

    Attributes:
        first: the number of the first frame.
    """

    def __init__(self, session: Session, fps: float, begin: float = 0.0) -> None:
        self._session = session
        self._fps = fps
        self.first = math.floor((begin + EPSILON) * fps)
        self._seats: list[_Seat] = []
        self._blocks: dict[int, Playing] = {}

    def look(self, t: float) -> None:
        """Take in every frame before `t`, as it is planned now: something is about to change."""
        if t * self._fps > self.first:
            self._take(first_at(t, self._fps))

    @property
    def blocks(self) -> list[Playing]:
        """All that were accepted, in that order."""
        return list(self._blocks.values())

    @property
    def still(self) -> float:
        """When nothing moves any more, but what the face does by itself: seconds on the session clock."""
        ends = [playing.gone for playing in self.blocks if playing.end < math.inf]
        for character in self._session.player.held_by:
            held = (*character.direct.values(), *character.feeling.values())
            ends += [float(one.times[-1]) if one.gone == math.inf else one.gone for one in held]
            ends += [shift.end for shift in character.shifts]
        return max(ends, default=0.0)

    def faces(self) -> list[tuple[int, str]]:
        """(n-th of the frames, face): what the first character looks like from there on."""
        return [(frame - self.first, name) for frame, name in self._seats[0].faces]

    def performances(self, count: int) -> dict[str | None, Performance]:
        """What each character does in the first `count` frames, the time of the first one being 0."""
        self._take(self.first + count)
        names = self._session.player.characters
        return {name: self._performance(seat) for name, seat in zip(names, self._seats, strict=True)}

    def _take(self, end: int) -> None:
        player = self._session.player
        self._blocks.update((playing.number, playing) for playing in player.cast.all())
        for index in range(len(player.characters)):
            if index == len(self._seats):
                self._seats.append(_Seat(self._session, index, self._fps, self.first))
            self._seats[index].take(end)

    def _performance(self, seat: _Seat) -> Performance:
        aus = seat.frames()
        starts = [frame - self.first for frame, _ in seat.faces]
        faps = [
            to_fap(_rows(aus, first, last), mapping_of(name, self._session.settings.mapping))
            for (first, last), (_, name) in zip(pairwise([*starts, len(aus.times)]), seat.faces, strict=True)
        ]
        values = np.concatenate([part.values for part in faps])
        mask = np.any([part.mask for part in faps], axis=0)
        return Performance(aus, FAPFrames(aus.times, values, mask))


class _Seat:
    """Where one character is looked at from: its frames so far.

    Attributes:
        faces: (frame, name): the face it has from there on.
    """

    def __init__(self, session: Session, index: int, fps: float, first: int) -> None:
        self._session = session
        self._index = index
        self._fps = fps
        self._timeline = session.broadcast.timeline(index, fps)
        self._next = first
        self._parts: list[AUFrames] = []
        self._window: Window | None = None  # the frames from `_begin` on are looked at, and are no part yet
        self._begin = first
        self.faces: list[tuple[int, str]] = []

    def take(self, end: int) -> None:
        """All frames before this one."""
        if self._next >= end:
            return
        if (face := self._session.faces.name(self._index)) not in (name for _, name in self.faces[-1:]):
            self.faces.append((self._next, face))
        while self._next < end:
            window = self._timeline.window(self._next, self._next)
            if window is not self._window:
                self._settle()
                self._window, self._begin = window, self._next
            assert len(window.aus.times)  # they are made when they are first asked for: now, of this plan
            self._next = min(end, window.end)

    def frames(self) -> AUFrames:
        """All of them; the time of the first one is 0."""
        self._settle()
        joined = AUFrames.joined(self._parts)
        times = np.arange(len(joined.times)) / self._fps
        return AUFrames(times, joined.values, joined.rules, joined.held, joined.columns)

    def _settle(self) -> None:
        """Keep of a window what was looked at: a plan may change long before its end."""
        if self._window is not None:
            first, last = (frame - self._window.first for frame in (self._begin, self._next))
            part = _rows(self._window.aus, first, last)
            held = None if part.held is None else part.held.copy()
            self._parts.append(AUFrames(part.times, part.values.copy(), part.rules, held, part.columns))
        self._window = None


def _rows(frames: AUFrames, first: int, last: int) -> AUFrames:
    held = None if frames.held is None else frames.held[first:last]
    times, values = frames.times[first:last], frames.values[first:last]
    return AUFrames(times, values, frames.rules, held, frames.columns)
