"""A record in, what was seen and heard of its session out, as of documents that are realized."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from bml_schema import Feedback
from realizer.realization import Realization, seen
from realizer.server.feedback_log import FeedbackLog
from realizer.server.journal.entry import JournalError
from realizer.server.journal.folder import Record
from realizer.server.journal.replay import replay
from realizer.server.session import Session
from realizer.server.studio import Studio
from realizer.settings import Settings, SettingsError

__all__ = ["played"]


def played(record: Record, **changed: Any) -> tuple[Realization, list[str]]:
    """Play a record again, to the end of what was planned last.

    Args:
        changed: settings that are to be other than they were, where they are not None.

    Returns:
        What was seen and heard, and the feedback as it was told, XML texts with their `seq`.

    Raises:
        JournalError: a setting or the scene of its head cannot be used here.
        FaceError: its face is not there.
    """
    asked = {name: value for name, value in changed.items() if value is not None}
    try:
        settings = Settings.read({**_settings(record.head), **asked})
    except SettingsError as error:
        raise JournalError(f"the record of {record.head['session']}: {error}") from None
    session = Session(
        record.head["session"],
        settings,
        0.0,
        named=True,
        scene=_scene(record.head),
        epoch=record.head["epoch"],
        history=float("inf"),
    )
    log = session.telling.log = _Whole(record.head["epoch"])
    studio = Studio(settings.deformer)
    try:
        replay(session, record.entries, studio.speak)
    finally:
        studio.close()
    # What was being said when the record broke off has no end of its own.
    last = record.entries[-1].at if record.entries else 0.0
    session.player.stop(last, session.intake.speeches.open)
    for feedback in session.player.due(float("inf")):
        session.log.add(feedback, float("inf"))
    player = session.player
    realization = seen(
        player,
        [feedback for feedback, _ in log.told],
        [playing.schedule for playing in player.cast.all()],
        fps=settings.fps,
        face=session.face_name(0),
        deformer=settings.deformer,
        mapping=session.mapping(0),
    )
    return realization, [text for _, text in log.told]


class _Whole(FeedbackLog):
    """All that a session ever tells, with its text."""

    def __init__(self, epoch: float | None) -> None:
        super().__init__(epoch)
        self.told: list[tuple[Feedback, str]] = []

    def add(self, feedback: Feedback, now: float) -> str:
        text = super().add(feedback, now)
        self.told.append((feedback, text))
        return text


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
