"""Checkpoints: the state of a session as journal parts, and its restoration."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from realizer.server.journal.entry import JournalError
from realizer.server.journal.serialization import character_of, plain_character, plain_schedule, schedule_of

if TYPE_CHECKING:
    from realizer.server.session.session import Session

VERSION = 1
STATE, CLIP = "state", "clip:"
# Of what was told, a checkpoint has the last so many messages and characters: minutes of talk. Who comes back
# has the rest already, or is told of a gap.
MOST_TOLD, MOST_TEXT = 1000, 2**19


def checkpoint(session: Session, t: float) -> bool:
    """Let the journal of a session begin anew, if the session is at rest.

    One whose journal is long, as its face never comes to rest, need only have nothing that plays: then a
    blink or a nod of the next seconds, which goes by what was said last, may be another after a takeover.

    Args:
        t: seconds on the session clock; what was due until then was told.

    Raises:
        Lost: another process has the session.
    """
    now = t if session.notes.overgrown else float("-inf")
    if not (session.intake.resting and session.player.resting(now)):
        return False
    parts: dict[str, str | None] = {STATE: json.dumps(_state(session, t), ensure_ascii=False)}
    parts |= {CLIP + id: text for id, text in session.clips.changes().items()}
    if kept := session.notes.compact(parts):
        session.clips.settle()
    return kept


def restore(session: Session, parts: Mapping[str, str]) -> float:
    """Let a new session be what one was at its checkpoint; connections that it had then are there again.

    Args:
        session: its clock is its caller's: it was opened at 0, and is written for by nobody.
        parts: as `Kept` has them.

    Returns:
        Seconds on its clock.

    Raises:
        JournalError: these are no parts, or of another version.
    """
    try:
        told = json.loads(parts[STATE])
        if told["version"] != VERSION:
            words = f"wanted one of version {VERSION}, got {told['version']!r}"
            raise JournalError(f"the checkpoint of session {session.id}: {words}")
        _restore(session, told, parts)
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        fault = f"{type(error).__name__}: {error}"
        raise JournalError(f"the checkpoint of session {session.id} cannot be read: {fault}") from None
    return float(told["at"])


def _state(session: Session, t: float) -> dict[str, Any]:
    player, intake = session.player, session.intake
    past, expected = player.cast.known()
    scene = player.world.scene
    return {
        "version": VERSION,
        "at": t,
        "connections": list(session.connections),
        "seq": session.log.newest,
        "told": _told(session),
        "scene": None if scene is None else {name: list(place) for name, place in scene.items()},
        "characters": [plain_character(character) for character in player.held_by],
        "faces": {str(index): face for index, face in session.faces.given.items()},
        "voices": {str(index): voice for index, voice in intake.voices.items()},
        "past": [plain_schedule(schedule) for schedule in past],
        "expected": plain_schedule(expected),
        "spoken": intake.orders.placed,
        "fault": intake.orders.fault,
        "clips": session.clips.ids,
    }


def _restore(session: Session, told: Mapping[str, Any], parts: Mapping[str, str]) -> None:
    player, intake = session.player, session.intake
    scene = told["scene"]
    player.set_scene(None if scene is None else {name: (x, y, z) for name, (x, y, z) in scene.items()})
    player.restore(
        map(character_of, told["characters"]), map(schedule_of, told["past"]), schedule_of(told["expected"])
    )
    session.faces.given.update({int(index): face for index, face in told["faces"].items()})
    intake.voices.update({int(index): voice for index, voice in told["voices"].items()})
    intake.orders.placed, intake.orders.fault = int(told["spoken"]), told["fault"]
    session.clips.restore((id, parts[CLIP + id]) for id in told["clips"])
    session.log.restore(int(told["seq"]), told["told"], float(told["at"]))
    for connection in told["connections"]:
        session.connect(int(connection), float(told["at"]))


def _told(session: Session) -> list[str]:
    """The last messages of the log, the oldest first."""
    found: list[str] = []
    size = 0
    for text in reversed(session.log.since(session.log.newest - MOST_TOLD + 1)):
        size += len(text)
        if size > MOST_TEXT:
            break
        found.append(text)
    return found[::-1]
