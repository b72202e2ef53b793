"""The frames of a replayed session, as a live viewer received them."""

import math
from dataclasses import replace

import numpy as np

from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames, FAPFrames
from realizer.face.fap_mapping import mapping_of
from realizer.playback.active_block import ActiveBlock
from realizer.realization import FaceChange, Performance
from realizer.server.session.session import Session
from realizer.server.streams.frame_windows import EPSILON, FrameWindow, first_frame_at


class ReplayViewer:
    """A viewer of all characters of a session, which stores their frames while time passes.

    The session itself forgets its past, as a live one does.

    Args:
        fps: frames a second; frame k is sampled at k / fps.
        begin: seconds on the session clock, at the first frame or less than a frame after it.

    Attributes:
        first: number of the first frame.
    """

    def __init__(self, session: Session, fps: float, begin: float = 0.0) -> None:
        self._session = session
        self._fps = fps
        self.first = math.floor((begin + EPSILON) * fps)
        self._recorders: list[_CharacterRecorder] = []
        self._blocks: dict[int, ActiveBlock] = {}

    def capture(self, t: float) -> None:
        """Store every frame before `t` as it is planned now, because the plan is about to change."""
        if t * self._fps > self.first:
            self._capture(first_frame_at(t, self._fps))

    @property
    def blocks(self) -> list[ActiveBlock]:
        """All accepted blocks, in order of acceptance."""
        return list(self._blocks.values())

    @property
    def idle_from(self) -> float:
        """Seconds on the session clock from which only idle motion is left."""
        ends = [block.invisible_after for block in self.blocks if block.end < math.inf]
        for character in self._session.player.character_states:
            for channel in (*character.direct.values(), *character.emotion.values()):
                ends.append(float(channel.times[-1]) if channel.faded_at == math.inf else channel.faded_at)
            ends += [shift.end for shift in character.shifts]
        return max(ends, default=0.0)

    @property
    def face_changes(self) -> tuple[FaceChange, ...]:
        """The faces of the first character."""
        return tuple(self._recorders[0].face_changes)

    def performances(self, count: int) -> dict[str | None, Performance]:
        """Return the first `count` frames of each character; the first one is at time 0."""
        self._capture(self.first + count)
        names = self._session.player.characters
        return {name: recorder.performance() for name, recorder in zip(names, self._recorders, strict=True)}

    def _capture(self, end: int) -> None:
        player = self._session.player
        self._blocks.update((block.number, block) for block in player.blocks.all())
        for index in range(len(player.characters)):
            if index == len(self._recorders):
                self._recorders.append(_CharacterRecorder(self._session, index, self._fps, self.first))
            self._recorders[index].capture(end)


class _CharacterRecorder:
    """The frames of one character so far."""

    def __init__(self, session: Session, index: int, fps: float, first: int) -> None:
        self._session = session
        self._index = index
        self._fps = fps
        self._timeline = session.broadcast.timeline(index, fps)
        self._next = first
        self._parts: list[AUFrames] = []
        self._window: FrameWindow | None = None  # its frames from `_begin` on are not in `_parts` yet
        self._begin = first
        self._first = first
        self.face_changes: list[FaceChange] = []

    def capture(self, end: int) -> None:
        """Capture all frames before `end`."""
        if self._next >= end:
            return
        face = self._session.faces.name(self._index)
        if face not in (change.face for change in self.face_changes[-1:]):
            mapping = mapping_of(face, self._session.settings.mapping)
            self.face_changes.append(FaceChange(self._next - self._first, face, mapping))
        while self._next < end:
            window = self._timeline.window(self._next, self._next)
            if window is not self._window:
                self._store_window()
                self._window, self._begin = window, self._next
            assert len(window.aus.times)  # computes the lazy frames now, from this plan
            self._next = min(end, window.end)

    def performance(self) -> Performance:
        """Return all frames; the first one is at time 0."""
        self._store_window()
        joined = AUFrames.concatenate(self._parts)
        aus = replace(joined, times=np.arange(len(joined.times)) / self._fps)
        ends = [*(change.frame for change in self.face_changes[1:]), len(aus.times)]
        faps = [
            to_fap(aus.part(c.frame, end), c.mapping) for c, end in zip(self.face_changes, ends, strict=True)
        ]
        values = np.concatenate([part.values for part in faps])
        mask = np.any([part.mask for part in faps], axis=0)
        return Performance(aus, FAPFrames(aus.times, values, mask))

    def _store_window(self) -> None:
        """Store the captured frames of the window: the plan may change long before its end."""
        if self._window is not None:
            first, last = (frame - self._window.first for frame in (self._begin, self._next))
            part = self._window.aus.part(first, last)
            overridden = None if part.overridden is None else part.overridden.copy()
            self._parts.append(replace(part, values=part.values.copy(), overridden=overridden))
        self._window = None
