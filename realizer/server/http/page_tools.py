"""Tools of the page: checks of a text, emotion previews, pose export."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import islice
from typing import TYPE_CHECKING, Any

from realizer.core.errors import RealizerError
from realizer.core.json_reader import parse_json
from realizer.core.settings import Settings

if TYPE_CHECKING:
    from realizer.checking.finding import Finding

MAX_TEXT = 50_000  # characters; checking takes a tenth of a second
MAX_FINDINGS = 100
SETTLED = 10.0  # s; by then set values are reached
FPS = 25.0
# The attributes of <emotion> that can be previewed.
EMOTION = {"name": str, "profile": str, "angle": int | float, "activation": int | float}


class ToolError(RealizerError):
    """A request that cannot be answered; the text says what was wanted."""

    status = 400


class UnknownName(ToolError):
    """A request for something of a name that does not exist."""

    status = 404


def lint(text: str, settings: Settings) -> str:
    """Return faults and advice for BML or a text as JSON: {"faults": [{type, id, text, notes, spots}]}.

    A spot is {line, column, length, text, primary}, from 1, in characters; the first primary one is the place
    of the fault. Faults are those of `realizer check`; advice has the type "ADVICE". What is left out of a
    text that is no markup is advice without spots.
    """
    from realizer.checking.source import findings_of
    from realizer.playback.player import Player
    from realizer.sources import is_markup, spoken

    if len(text) > MAX_TEXT:
        words = f"wanted at most {MAX_TEXT} characters, got {len(text)}: `realizer check` reads more"
        return json.dumps({"faults": [], "skipped": words})
    plain = text.strip() != "" and not is_markup(text)
    document = spoken(text, language=settings.language) if plain else text
    findings = findings_of("document", document, Player(settings.play_options()), MAX_FINDINGS)
    faults = [_finding_json(finding) for finding in islice(findings, MAX_FINDINGS)]
    if plain:  # the places are in a document that the user does not see
        faults = [{**fault, "type": "ADVICE", "spots": []} for fault in faults]
    return json.dumps({"faults": faults}, ensure_ascii=False)


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


def preview_emotion(request: str) -> str:
    """Return the action units or FAPs of an emotion: a point of the wheel, or a profile.

    Args:
        request: JSON with the attributes of <emotion>: angle and activation, or name; profile.

    Returns:
        JSON {"values": {"12L": 0..1, or a FAP's name: in its FAPU}, "shares": {archetype: 0..1}}.

    Raises:
        ToolError: the request is not an emotion.
    """
    from bml_schema import Emotion
    from realizer.behaviours import emotion
    from realizer.behaviours.kind import PlanningContext
    from realizer.emotions.wheel import blend_weights

    fields = {k: v for k, v in _object(request).items() if k in EMOTION and v is not None}
    if wrong := [name for name, value in fields.items() if not isinstance(value, EMOTION[name])]:
        raise ToolError(f"feeling: {wrong[0]}: wanted a {'text' if EMOTION[wrong[0]] is str else 'number'}")
    try:
        node = Emotion(id="asked", **fields)
        fault = node.fault() or next((fault.text for fault in emotion.check(node, PlanningContext())), "")
        if fault:
            raise ToolError(fault)
        values = emotion.values_of(node)
        weights = blend_weights(node.angle, node.profile or "own") if node.angle is not None else {}
    except (TypeError, ValueError, ArithmeticError) as error:
        raise ToolError(f"feeling: {error}") from None
    return json.dumps(
        {
            "values": {target.name: round(float(value), 4) for target, value in values.items()},
            "shares": {name: round(weight, 4) for name, weight in weights.items()},
        }
    )


def export_pose(message: str, face: str | None, settings: Settings) -> str:
    """Return the pose that a `set` message makes, as a FAP file of one frame.

    Args:
        face: name of the face whose mapping from AUs to FAPs is used; None: that of the service.

    Raises:
        ToolError: the message is not a `set` message, or there is no such face.
    """
    import numpy as np

    from realizer.animation.fap.conversion import to_fap
    from realizer.animation.fap.fap_clip import FAPClip
    from realizer.outputs.fap_text import encode
    from realizer.server.session.session import Session

    if _object(message).get("type") != "set":
        raise ToolError("wanted a message of the type set")
    # A session handles the message, so that the file has what the page shows, without idle motion.
    session = Session("pose", replace(settings, idle=False), 0.0)
    session.connect(1, 0.0)
    if face is not None:
        session.receive(1, json.dumps({"type": "character", "face": face}), 0.0)
    session.receive(1, message, 0.0)
    for effect in session.take_effects():
        data = getattr(effect, "data", None)
        if isinstance(data, str) and data.startswith("{"):
            reply = json.loads(data)
            if reply["type"] == "error":
                raise ToolError(f"{reply.get('where', 'set')}: {reply['message']}")
    timeline = session.broadcast.timeline(0, FPS)
    frame = round(SETTLED * FPS)
    frames = to_fap(timeline.window(frame, frame).aus, session.faces.mapping(0))
    clip = FAPClip.of(replace(frames, times=np.zeros(1), values=frames.values[:1]), FPS, "pose")
    return encode(clip)


def _object(text: str) -> dict[str, Any]:
    try:
        value = parse_json(text)
    except ValueError as error:
        raise ToolError(f"wanted a JSON object: {error}") from None
    if not isinstance(value, dict):
        raise ToolError(f"wanted a JSON object, got {type(value).__name__}")
    return value
