"""The behaviours of BML 1.0 core, and faceFacs: one class per element."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Final

from bml_schema.node_schema import attribute, child, children, mixed, node, sync_ref
from bml_schema.nodes import Behaviour, Part, core, extension, own
from bml_schema.sync_refs import SyncRef
from bml_schema.values import integer, name, number, one_of, string, word

HOLD: Final = ("start", "ready", "relax", "end")
STROKE: Final = ("start", "ready", "strokeStart", "stroke", "strokeEnd", "relax", "end")
PEAK: Final = ("start", "attackPeak", "relax", "end")

DIRECTIONS: Final = ("RIGHT", "LEFT", "UP", "DOWN", "UPRIGHT", "UPLEFT", "DOWNLEFT", "DOWNRIGHT")
HANDS: Final = ("LEFT_HAND", "RIGHT_HAND", "BOTH_HANDS")
SIDES: Final = ("LEFT", "RIGHT", "BOTH")
STANCES: Final = ("SITTING", "CROUCHING", "STANDING", "LYING")
BODY_PARTS: Final = ("ARMS", "LEFT_ARM", "RIGHT_ARM", "LEGS", "LEFT_LEG", "RIGHT_LEG", "HEAD", "WHOLEBODY")

AMOUNT = number(0, 1)
# Relative excess of attackPeak over the sustained amount; at -1 the peak is 0.
_OVERSHOOT = number(-1, 10)
_ANGLE = number(-360, 360)
_STYLE = number(0, 2)


@node
class Gaze(Behaviour):
    """Look at something for a while."""

    tag = core("gaze")
    sync_points = HOLD
    target: str = attribute(word)
    influence: str | None = attribute(word, default=None)
    offset_angle: float = attribute(_ANGLE, default=0.0)
    offset_direction: str = attribute(one_of(*DIRECTIONS), default="RIGHT")


@node
class GazeShift(Behaviour):
    """Look at something from now on."""

    tag = core("gazeShift")
    target: str = attribute(word)
    influence: str | None = attribute(word, default=None)
    offset_angle: float = attribute(_ANGLE, default=0.0)
    offset_direction: str = attribute(one_of(*DIRECTIONS), default="RIGHT")


@node
class Head(Behaviour):
    """Move the head rhythmically: NOD, SHAKE; with repetition n it has stroke:1 .. stroke:n."""

    tag = core("head")
    sync_points = STROKE
    lexeme: str = attribute(word)
    # More than 100 nods are a mistake; each has sync points to schedule and report.
    repetition: int = attribute(integer(1, 100), default=1)
    amount: float = attribute(AMOUNT, default=0.5)


@node
class HeadDirectionShift(Behaviour):
    """Turn the head towards something from now on."""

    tag = core("headDirectionShift")
    target: str = attribute(word)


@node
class FaceLexeme(Behaviour):
    """A facial expression by name; inside <face> it has no timing, and its id is optional."""

    tag = core("faceLexeme")
    sync_points = PEAK
    lexeme: str = attribute(word)
    amount: float = attribute(AMOUNT, default=0.5)
    overshoot: float = attribute(_OVERSHOOT, default=0.0)


@node
class FaceFacs(Behaviour):
    """One FACS action unit; inside <face> it has no timing, and its id is optional."""

    tag = extension("faceFacs")
    sync_points = PEAK
    au: int = attribute(integer(1, 999))
    side: str = attribute(one_of(*SIDES), default="BOTH")
    amount: float = attribute(AMOUNT, default=0.5)
    overshoot: float = attribute(_OVERSHOOT, default=0.0)


@node
class Face(Behaviour):
    """Several expressions and action units that share one timing."""

    tag = core("face")
    sync_points = PEAK
    amount: float = attribute(AMOUNT, default=0.5)
    overshoot: float = attribute(_OVERSHOOT, default=0.0)
    parts: tuple[FaceLexeme | FaceFacs, ...] = children(FaceLexeme, FaceFacs, least=1)


@node
class FaceShift(Behaviour):
    """Several expressions and action units that are the resting face from now on."""

    tag = core("faceShift")
    amount: float = attribute(AMOUNT, default=0.5)
    overshoot: float = attribute(_OVERSHOOT, default=0.0)
    parts: tuple[FaceLexeme | FaceFacs, ...] = children(FaceLexeme, FaceFacs, least=1)


@node
class Sync(Part):
    """A named point between two words; `ref` is an optional reference for its time."""

    tag = core("sync")
    id: str = attribute(name)
    ref: SyncRef | None = attribute(sync_ref, default=None)


@node
class SpeechText(Part):
    """The text of a speech: strings and Syncs in order, with whitespace as written.

    Attributes:
        parts: neighbouring strings are joined.
        language: xml:lang, or "".
    """

    tag = core("text")
    parts: tuple[str | Sync, ...] = mixed(Sync, default=())
    language: str = attribute(string, default="", name="{http://www.w3.org/XML/1998/namespace}lang")

    def __str__(self) -> str:
        return "".join(p for p in self.parts if isinstance(p, str))


@node
class Speech(Behaviour):
    """Say something; each <sync id> in the text is a sync point too.

    Attributes:
        jaw, lips: how far the jaw, or the lips, move: 0 mumbles, 1 is usual, 2 over-articulates; without it
            the setting of the realizer.
    """

    tag = core("speech")
    marks = True
    text: SpeechText | None = child(SpeechText, default=None)
    jaw: float | None = attribute(_STYLE, default=None, name=own("jaw"))
    lips: float | None = attribute(_STYLE, default=None, name=own("lips"))

    @property
    def marked(self) -> tuple[str, ...]:
        """The ids of the syncs in the text, in order."""
        return tuple(p.id for p in self.text.parts if isinstance(p, Sync)) if self.text else ()

    @property
    def references(self) -> tuple[tuple[str, SyncRef], ...]:
        """(sync point, reference) of each sync point with a reference, then those of syncs in the text."""
        syncs = (p for p in (self.text.parts if self.text else ()) if isinstance(p, Sync))
        return (*self.syncs.items(), *((p.id, p.ref) for p in syncs if p.ref is not None))

    def with_references(self, ref_of: Callable[[Sync], SyncRef | None]) -> Speech:
        """Return the speech with `ref_of(sync)` as the reference of each sync in its text."""
        if self.text is None:
            return self
        parts = tuple(replace(p, ref=ref_of(p)) if isinstance(p, Sync) else p for p in self.text.parts)
        return replace(self, text=replace(self.text, parts=parts))

    def fault(self) -> str:
        seen = set(self.sync_points)
        for id in self.marked:
            if id in seen:
                return f'sync: wanted an id of its own, got "{id}" again'
            seen.add(id)
        return ""


@node
class Wait(Behaviour):
    """Wait for some seconds, or as long as its start and end references require."""

    tag = core("wait")
    duration: float = attribute(number(0, 86400, wanted="seconds, 0..86400"), default=0.0, old="max-wait")


@node
class Gesture(Behaviour):
    """A gesture of the arms by name."""

    tag = core("gesture")
    sync_points = STROKE
    lexeme: str = attribute(word)
    mode: str | None = attribute(one_of(*HANDS), default=None)


@node
class Pointing(Behaviour):
    """Point at something."""

    tag = core("pointing")
    sync_points = STROKE
    target: str = attribute(word)
    mode: str | None = attribute(one_of(*HANDS), default=None)


@node
class Stance(Part):
    """The stance of the body: sitting, crouching, standing or lying."""

    tag = core("stance")
    type: str = attribute(one_of(*STANCES))


@node
class Pose(Part):
    """The pose of one part of the body."""

    tag = core("pose")
    part: str = attribute(one_of(*BODY_PARTS))
    lexeme: str = attribute(word)


@node
class Posture(Behaviour):
    """Take a posture for a while."""

    tag = core("posture")
    sync_points = HOLD
    stance: Stance | None = child(Stance, default=None)
    poses: tuple[Pose, ...] = children(Pose, default=())


@node
class PostureShift(Behaviour):
    """Take a posture from now on."""

    tag = core("postureShift")
    stance: Stance | None = child(Stance, default=None)
    poses: tuple[Pose, ...] = children(Pose, default=())


@node
class Locomotion(Behaviour):
    """Go somewhere."""

    tag = core("locomotion")
    target: str = attribute(word)
    manner: str = attribute(word, default="WALK")
