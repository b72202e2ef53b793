"""Replay of recordings: returns feedback, frames and sound as viewers received them."""

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from bml_schema import Feedback
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames, FAPFrames
from realizer.core.settings import Settings, SettingsError
from realizer.face.fap_mapping import mapping_of
from realizer.playback.active_block import ActiveBlock
from realizer.playback.scheduled_speech import ScheduledSpeech
from realizer.realization import FaceChange, Performance, Realization, frames_until, merge_warnings
from realizer.server.journal.entry import JournalError, SavedSession
from realizer.server.journal.replay import replay, replay_until, restore_checkpoint
from realizer.server.runtime.engines import Engines
from realizer.server.session.connections import FeedbackLog
from realizer.server.session.session import Session
from realizer.server.speech.speech_streams import OPEN
from realizer.server.streams.frame_windows import EPSILON, FrameWindow, first_frame_at


class ReplayViewer:
    """A viewer of all characters of a session, which stores their frames while time passes.

    The session itself forgets its past, as a live one does.

    Args:
        fps: frames a second; frame k is sampled at k / fps.
        begin: seconds on the session clock, at the first frame or less than a frame after it.
    """

    def __init__(self, session: Session, fps: float, begin: float = 0.0) -> None:
        self._session = session
        self._fps = fps
        self.first = math.floor((begin + EPSILON) * fps)  # number of the first frame
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
        for character in self._session.player.cast:
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


def replay_feedback(recording: SavedSession, **changed: Any) -> list[str]:
    """Replay a recording and return its feedback, XML texts with `seq`.

    Raises the errors of `replay_recording`.
    """
    repeated = _Replay(recording, changed)
    repeated.play()
    return [text for _, text in repeated.log.messages]


def replay_recording(recording: SavedSession, **changed: Any) -> tuple[Realization, list[str]]:
    """Replay a recording until it has ended, and all its planned and directly set motion too.

    The result is what viewers saw: a message that changes plans has no effect on earlier frames. If the
    recording begins with a checkpoint, times count from there.

    Args:
        changed: settings that replace those of the recording; None keeps the recorded one.

    Returns:
        The realization with frames and sound, and the feedback, XML texts with `seq`.

    Raises:
        JournalError: a setting, the scene or the checkpoint of the recording cannot be used here.
        FaceError: there is no such face.
        RealizerError: the recording lasts too long.
    """
    repeated = _Replay(recording, changed)
    session, settings = repeated.session, repeated.session.settings
    viewer = ReplayViewer(session, settings.fps, repeated.begin)
    begin = viewer.first / settings.fps
    frames_until(repeated.last - begin, settings.fps)  # raises if it lasts too long
    repeated.play(viewer.capture)
    end = max(repeated.last, viewer.idle_from) - begin
    characters = viewer.performances(frames_until(end, settings.fps))
    feedback = [feedback for feedback, _ in repeated.log.messages]
    schedules = [block.latest for block in viewer.blocks]
    speeches = [_earlier(speech, begin) for block in viewer.blocks for speech in block.speech.values()]
    realization = Realization(
        fps=settings.fps,
        duration=end,
        face_name=session.faces.name(0),
        face_changes=viewer.face_changes,
        characters=characters,
        schedules=tuple(replace(schedule, start=schedule.start - begin) for schedule in schedules),
        feedback_events=tuple(feedback),
        warnings=merge_warnings(feedback, schedules),
        speeches=tuple(sorted(speeches, key=lambda speech: speech.start)),
        deformer=settings.deformer,
        mapping=session.faces.mapping(0),
    )
    return realization, [text for _, text in repeated.log.messages]


class _Replay:
    """A session that repeats a recorded one.

    Attributes:
        begin, last: times of the recording's begin and of its last entry, on the session clock.
    """

    def __init__(self, recording: SavedSession, changed: Mapping[str, Any]) -> None:
        head, name = recording.head, recording.head["session"]
        if not isinstance(recorded := head.get("settings", {}), dict):
            raise JournalError(f"the head of a recording: settings: wanted an object, got {recorded!r:.80}")
        overrides = {option: value for option, value in changed.items() if value is not None}
        try:
            settings = Settings.read({**recorded, **overrides})
        except SettingsError as error:
            raise JournalError(f"the recording of {name}: {error}") from None
        self.log = _FullLog(recording.epoch)
        self.session = Session(name, settings, 0.0, named=True, scene=_scene(head), log=self.log)
        self.begin = restore_checkpoint(self.session, recording.parts) if recording.parts else 0.0
        self._entries = recording.entries
        self.last = recording.entries[-1].at if recording.entries else self.begin

    def play(self, look: Callable[[float], None] = lambda t: None) -> None:
        """Replay all entries, and then the remaining plans; `look` as in `replay`."""
        session = self.session
        engines = Engines(session.settings.deformer)
        try:
            replay(session, self._entries, engines.speak, look)
        finally:
            engines.close()
        # An open speech has no end; it ends when all other blocks have ended.
        ends = [block.end for block in session.player.blocks.active()]
        end = max((end for end in ends if end < self.last + OPEN / 2), default=self.last)
        replay_until(session, end, look, since=self.last)
        look(end)
        session.player.stop(end, session.submission.speeches.open_ids)
        replay_until(session, float("inf"), look, since=end)


class _FullLog(FeedbackLog):
    """A log of all feedback of a session, with its texts."""

    def __init__(self, epoch: float | None) -> None:
        super().__init__(epoch)
        self.messages: list[tuple[Feedback, str]] = []

    def add(self, feedback: Feedback, now: float) -> str:
        text = super().add(feedback, now)
        self.messages.append((feedback, text))
        return text


def _earlier(speech: ScheduledSpeech, seconds: float) -> ScheduledSpeech:
    gains = tuple(gain.shifted(-seconds) for gain in speech.gains)
    return replace(speech, start=speech.start - seconds, until=speech.until - seconds, gains=gains)


def _scene(head: Mapping[str, Any]) -> dict[str, tuple[float, float, float]] | None:
    if (scene := head.get("scene")) is None:
        return None
    try:
        return {str(name): (float(x), float(y), float(z)) for name, (x, y, z) in scene.items()}
    except (AttributeError, TypeError, ValueError):
        raise JournalError(f"the head of a recording: scene: wanted positions, got {scene!r:.80}") from None
