"""Replay of recordings: returns feedback, frames and sound as viewers received them."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from bml_schema import Feedback
from realizer.core.settings import Settings, SettingsError
from realizer.playback.scheduled_speech import ScheduledSpeech
from realizer.realization import Realization, frames_until, merge_warnings
from realizer.server.journal.entry import JournalError, SavedSession
from realizer.server.journal.replay import replay
from realizer.server.journal.replay_viewer import ReplayViewer
from realizer.server.runtime.effect_runner import Engines
from realizer.server.session.feedback_log import FeedbackLog
from realizer.server.session.session import Session
from realizer.server.speech.speech_streams import OPEN


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
        self.begin = self.session.restore(recording.parts) if recording.parts else 0.0
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
        session.replay_until(end, look, since=self.last)
        look(end)
        session.player.stop(end, session.submission.speeches.open_ids)
        session.replay_until(float("inf"), look, since=end)


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
