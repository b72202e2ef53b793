"""The frames of a replayed session, as a live viewer received them."""

from __future__ import annotations

import math

import numpy as np

from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames, FAPFrames
from realizer.face.fap_mapping import mapping_of
from realizer.playback.active_block import ActiveBlock
from realizer.realization import FaceChange, Performance
from realizer.server.session.session import Session
from realizer.server.streams.frame_windows import EPSILON, FrameWindow, first_frame_at


class ReplayViewer:
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
        self._recorders: list[_CharacterRecorder] = []
        self._blocks: dict[int, ActiveBlock] = {}

    def capture(self, t: float) -> None:
        """Take in every frame before `t`, as it is planned now: something is about to change."""
        if t * self._fps > self.first:
            self._take(first_frame_at(t, self._fps))

    @property
    def blocks(self) -> list[ActiveBlock]:
        """All that were accepted, in that order."""
        return list(self._blocks.values())

    @property
    def idle_from(self) -> float:
        """When nothing moves any more, but what the face does by itself: seconds on the session clock."""
        ends = [playing.invisible_after for playing in self.blocks if playing.end < math.inf]
        for character in self._session.player.character_states:
            held = (*character.direct.values(), *character.emotion.values())
            ends += [float(one.times[-1]) if one.faded_at == math.inf else one.faded_at for one in held]
            ends += [shift.end for shift in character.shifts]
        return max(ends, default=0.0)

    @property
    def face_changes(self) -> tuple[FaceChange, ...]:
        """The faces of the first character."""
        return self._face_changes(self._recorders[0])

    def performances(self, count: int) -> dict[str | None, Performance]:
        """What each character does in the first `count` frames, the time of the first one being 0."""
        self._take(self.first + count)
        names = self._session.player.characters
        return {name: self._performance(seat) for name, seat in zip(names, self._recorders, strict=True)}

    def _take(self, end: int) -> None:
        player = self._session.player
        self._blocks.update((playing.number, playing) for playing in player.blocks.all())
        for index in range(len(player.characters)):
            if index == len(self._recorders):
                self._recorders.append(_CharacterRecorder(self._session, index, self._fps, self.first))
            self._recorders[index].capture(end)

    def _performance(self, seat: _CharacterRecorder) -> Performance:
        aus = seat.frames()
        worn = self._face_changes(seat)
        ends = [*(one.frame for one in worn[1:]), len(aus.times)]
        faps = [to_fap(aus.part(one.frame, end), one.mapping) for one, end in zip(worn, ends, strict=True)]
        values = np.concatenate([part.values for part in faps])
        mask = np.any([part.mask for part in faps], axis=0)
        return Performance(aus, FAPFrames(aus.times, values, mask))

    def _face_changes(self, seat: _CharacterRecorder) -> tuple[FaceChange, ...]:
        mapping = self._session.settings.mapping
        return tuple(
            FaceChange(frame - self.first, name, mapping_of(name, mapping)) for frame, name in seat.faces
        )


class _CharacterRecorder:
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
        self._window: FrameWindow | None = (
            None  # the frames from `_begin` on are looked at, and are no part yet
        )
        self._begin = first
        self.faces: list[tuple[int, str]] = []

    def capture(self, end: int) -> None:
        """All frames before this one."""
        if self._next >= end:
            return
        if (face := self._session.faces.name(self._index)) not in (name for _, name in self.faces[-1:]):
            self.faces.append((self._next, face))
        while self._next < end:
            window = self._timeline.window(self._next, self._next)
            if window is not self._window:
                self._store_window()
                self._window, self._begin = window, self._next
            assert len(window.aus.times)  # they are made when they are first asked for: now, of this plan
            self._next = min(end, window.end)

    def frames(self) -> AUFrames:
        """All of them; the time of the first one is 0."""
        self._store_window()
        joined = AUFrames.concatenate(self._parts)
        times = np.arange(len(joined.times)) / self._fps
        return AUFrames(times, joined.values, joined.rules, joined.overridden, joined.columns)

    def _store_window(self) -> None:
        """Keep of a window what was looked at: a plan may change long before its end."""
        if self._window is not None:
            first, last = (frame - self._window.first for frame in (self._begin, self._next))
            part = self._window.aus.part(first, last)
            held = None if part.overridden is None else part.overridden.copy()
            self._parts.append(AUFrames(part.times, part.values.copy(), part.rules, held, part.columns))
        self._window = None
