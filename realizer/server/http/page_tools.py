"""Tools of the page: checks of a text, emotion previews, pose export."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Any

from realizer.core.errors import RealizerError
from realizer.core.options import PlayOptions
from realizer.core.settings import Settings

if TYPE_CHECKING:
    from realizer.checking.finding import Finding

# A text of this length is checked in a tenth of a second; longer ones have `realizer check`.
MAX_TEXT = 50_000  # characters
MAX_FINDINGS = 100
# By then whatever was set has settled; 25 frames a second.
SETTLED = 10.0  # s
FPS = 25.0


class ToolError(RealizerError):
    """What was asked cannot be answered; the text says what was wanted."""


def lint(text: str, settings: Settings) -> str:
    """Faults and advice of BML as JSON: {"faults": [{type, id, text, notes, spots}]}.

    A spot is {line, column, length, text, primary}, from 1, in characters; the first primary one is where the
    fault is. Faults are what `realizer check` tells, advice has the type "ADVICE".
    """
    from bml_schema.source import Source
    from realizer.checking.advice import advice
    from realizer.checking.document import check_document
    from realizer.playback.player import Player

    if len(text) > MAX_TEXT:
        said = f"wanted at most {MAX_TEXT} characters, got {len(text)}: `realizer check` reads more"
        return json.dumps({"faults": [], "skipped": said})
    source = Source(text)
    found: list[Finding] = []
    player = Player(PlayOptions(idle=False, media=settings.media, expressions=settings.expressions))
    for part in check_document("document", source, text, player):
        found += part.findings
        if part.block is not None and part.schedule is not None:
            found += islice(advice("document", source, part.block, part.schedule, player), MAX_FINDINGS)
    return json.dumps(
        {"faults": [_finding_json(finding) for finding in found[:MAX_FINDINGS]]}, ensure_ascii=False
    )


def _finding_json(finding: Finding) -> dict[str, Any]:
    spots = [
        {**label.spot._asdict(), "text": label.text, "primary": label.primary} for label in finding.labels
    ]
    return {
        "type": finding.type,
        "id": finding.id,
        "text": finding.head,
        "notes": list(finding.notes),
        "spots": spots,
    }


def preview_emotion(asked: str) -> str:
    """A place on the wheel, or a profile, as what it moves.

    Args:
        asked: JSON with the fields of <emotion>: angle and activation, or name; profile.

    Returns:
        JSON {"values": {"12L": 0..1, or a FAP's name: in its FAPU}, "shares": {archetype: 0..1}}.

    Raises:
        DeskError: not a feeling.
    """
    from bml_schema import Emotion
    from realizer.behaviours import emotion
    from realizer.behaviours.kind import PlanningContext
    from realizer.emotions.wheel import blend_weights

    fields = {k: v for k, v in _object(asked).items() if k in ("name", "angle", "activation", "profile")}
    node = Emotion(id="asked", **fields)
    try:
        wrong = node.fault() or next((fault.text for fault in emotion.check(node, PlanningContext())), "")
        if wrong:
            raise ToolError(wrong)
        values = emotion.values_of(node)
        mixed = blend_weights(node.angle, node.profile or "own") if node.angle is not None else {}
    except (TypeError, ValueError) as error:
        raise ToolError(f"feeling: {error}") from None
    return json.dumps(
        {
            "values": {target.name: round(float(value), 4) for target, value in values.items()},
            "shares": {name: round(share, 4) for name, share in mixed.items()},
        }
    )


def export_pose(asked: str, face: str | None, settings: Settings) -> str:
    """The face that a `set` message holds, as a FAP file of one frame.

    Args:
        asked: the message; face: whose mapping of AUs to FAPs holds, None the service's.

    Raises:
        DeskError: not a `set` message, or no such face.
    """
    import numpy as np

    from realizer.animation.fap.fap_clip import FAPClip
    from realizer.outputs.fap_text import encode
    from realizer.server.session.session import Session

    if _object(asked).get("type") != "set":
        raise ToolError("wanted a message of the type set")
    # The session itself answers, so that the file holds what the page shows, less what moves by itself.
    session = Session("pose", replace(settings, idle=False), 0.0)
    session.connect(1, 0.0)
    if face is not None:
        session.receive(1, json.dumps({"type": "character", "face": face}), 0.0)
    session.receive(1, asked, 0.0)
    for effect in session.take_effects():
        data = getattr(effect, "data", None)
        if isinstance(data, str) and data.startswith("{"):
            told = json.loads(data)
            if told["type"] == "error":
                raise ToolError(f"{told.get('where', 'set')}: {told['message']}")
    timeline = session.broadcast.timeline(0, FPS)
    frame = round(SETTLED * FPS)
    frames = timeline.window(frame, frame).faps
    clip = FAPClip.of(replace(frames, times=np.zeros(1), values=frames.values[:1]), FPS, "pose")
    return encode(clip)


def _object(text: str) -> dict[str, Any]:
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise ToolError(f"wanted a JSON object: {error}") from None
    if not isinstance(found, dict):
        raise ToolError(f"wanted a JSON object, got {type(found).__name__}")
    return found
