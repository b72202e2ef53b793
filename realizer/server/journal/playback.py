"""Replay of a recording: feedback, frames and sound as its viewers received them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

from bml_schema import Feedback
from realizer.core.settings import Settings, SettingsError
from realizer.playback.active_block import ScheduledSpeech
from realizer.realization import Realization, frames_until, merge_warnings
from realizer.server.journal.entry import JournalError
from realizer.server.journal.recordings import Record
from realizer.server.journal.replay import replay
from realizer.server.journal.replay_viewer import ReplayViewer
from realizer.server.runtime.engines import Engines
from realizer.server.session.feedback_log import FeedbackLog
from realizer.server.session.session import Session
from realizer.server.speech.speech_streams import OPEN


def replay_feedback(record: Record, **changed: Any) -> list[str]:
    """The feedback of a session that is played again, XML texts with their `seq`; as `replay_recording`."""
    again = _Replay(record, changed)
    again.play()
    return [text for _, text in again.log.told]


def replay_recording(record: Record, **changed: Any) -> tuple[Realization, list[str]]:
    """Play a record again, as it was seen: to its end, or until nothing moves that was planned or held.

    What was only planned before something else was done is not in it; nor is what is past changed by what
    was done later. A record that begins with a checkpoint is seen from there: all times are from then on.

    Args:
        changed: settings that are to be other than they were, where they are not None.

    Returns:
        What was seen and heard, and the feedback as it was told, XML texts with their `seq`.

    Raises:
        JournalError: a setting, the scene or the checkpoint of its head cannot be used here.
        FaceError: its face is not there.
        RealizerError: it lasts too long.
    """
    again = _Replay(record, changed)
    session, settings = again.session, again.session.settings
    viewer = ReplayViewer(session, settings.fps, again.begin)
    begin = viewer.first / settings.fps
    frames_until(again.last - begin, settings.fps)
    again.play(viewer.capture)
    end = max(again.last, viewer.idle_from) - begin
    characters = viewer.performances(frames_until(end, settings.fps))
    feedback = [feedback for feedback, _ in again.log.told]
    schedules = [playing.latest for playing in viewer.blocks]
    speaking = [said for playing in viewer.blocks for said in playing.speech.values()]
    realization = Realization(
        fps=settings.fps,
        duration=end,
        face_name=session.faces.name(0),
        face_changes=viewer.face_changes,
        characters=characters,
        schedules=tuple(replace(one, start=one.start - begin) for one in schedules),
        feedback_events=tuple(feedback),
        warnings=merge_warnings(feedback, schedules),
        speeches=tuple(sorted((_earlier(one, begin) for one in speaking), key=lambda one: one.start)),
        deformer=settings.deformer,
        mapping=session.faces.mapping(0),
    )
    return realization, [text for _, text in again.log.told]


class _Replay:
    """A session that is to be what was recorded.

    Attributes:
        begin: seconds on its clock where the record begins.
        last: and of what was done last.
    """

    def __init__(self, record: Record, changed: Mapping[str, Any]) -> None:
        head = record.head
        asked = {name: value for name, value in changed.items() if value is not None}
        try:
            settings = Settings.read({**_settings(head), **asked})
        except SettingsError as error:
            raise JournalError(f"the record of {head['session']}: {error}") from None
        self.log = _FullLog(head["epoch"])
        self.session = Session(head["session"], settings, 0.0, named=True, scene=_scene(head), log=self.log)
        self.begin = self.session.restore(record.parts) if record.parts else 0.0
        self._entries = record.entries
        self.last = record.entries[-1].at if record.entries else self.begin

    def play(self, look: Callable[[float], None] = lambda t: None) -> None:
        """Do all of it, and let what plays then come to its end; `look` as in `replay`."""
        session = self.session
        studio = Engines(session.settings.deformer)
        try:
            replay(session, self._entries, studio.speak, look)
        finally:
            studio.close()
        # What was being said when the record broke off has no end of its own: it ends with what is planned.
        ends = [playing.end for playing in session.player.blocks.active()]
        end = max((end for end in ends if end < self.last + OPEN / 2), default=self.last)
        session.replay_until(end, look, since=self.last)
        look(end)
        session.player.stop(end, session.submission.speeches.open_ids)
        session.replay_until(float("inf"), look, since=end)


class _FullLog(FeedbackLog):
    """All that a session ever tells, with its text."""

    def __init__(self, epoch: float | None) -> None:
        super().__init__(epoch)
        self.told: list[tuple[Feedback, str]] = []

    def add(self, feedback: Feedback, now: float) -> str:
        text = super().add(feedback, now)
        self.told.append((feedback, text))
        return text


def _earlier(speaking: ScheduledSpeech, seconds: float) -> ScheduledSpeech:
    gains = tuple(gain.shifted(-seconds) for gain in speaking.gains)
    return replace(speaking, start=speaking.start - seconds, until=speaking.until - seconds, gains=gains)


def _settings(head: Mapping[str, Any]) -> dict[str, Any]:
    found = head.get("settings", {})
    if not isinstance(found, dict):
        raise JournalError(f"the head of a record: settings: wanted an object, got {found!r:.80}")
    return found


def _scene(head: Mapping[str, Any]) -> dict[str, tuple[float, float, float]] | None:
    if (scene := head.get("scene")) is None:
        return None
    try:
        return {str(name): (float(x), float(y), float(z)) for name, (x, y, z) in scene.items()}
    except (AttributeError, TypeError, ValueError):
        raise JournalError(f"the head of a record: scene: wanted places, got {scene!r:.80}") from None
