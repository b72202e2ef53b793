"""The behaviours that this project adds to BML, in its own namespace `urn:bml-realizer:1`."""

from __future__ import annotations

from bml_schema.behaviours import AMOUNT, PEAK, SIDES
from bml_schema.nodes import Behaviour, Part, own
from bml_schema.shape import attribute, children, node
from bml_schema.values import integer, number, one_of, word

__all__ = ["Blink", "Emotion", "Expression", "Fap", "FapFile", "Faps", "Idle", "Mood"]

_ANGLE = number(-360, 360)  # degrees on the wheel of emotions
_ACTIVATION = number(1, 7)  # on Whissel's scale
_FAPU = number(-1e5, 1e5)


def _one_place(name: str | None, angle: float | None, activation: float | None) -> str:
    """What is wrong with the ways in which an emotion is named."""
    if (name is None) == (angle is None):
        return "wanted a name, or an angle on the wheel, got " + ("neither" if name is None else "both")
    return "" if activation is None or angle is not None else "activation: wanted an angle with it, got none"


@node
class Emotion(Behaviour):
    """Show an emotion for a while.

    Attributes:
        name: its word.
        angle, activation: instead of a word, its place on the wheel; activation 1..7, None the angle's own.
        intensity: 0.5 moderate, 1 maximal.
        profile: which of several ways to show it; None the usual one.
    """

    tag = own("emotion")
    sync_points = PEAK
    name: str | None = attribute(word, default=None)
    angle: float | None = attribute(_ANGLE, default=None)
    activation: float | None = attribute(_ACTIVATION, default=None)
    intensity: float = attribute(AMOUNT, default=0.5)
    profile: str | None = attribute(word, default=None)

    def fault(self) -> str:
        return _one_place(self.name, self.angle, self.activation)


@node
class Mood(Behaviour):
    """An emotion that is the resting face from now on; attributes as of `Emotion`."""

    tag = own("mood")
    name: str | None = attribute(word, default=None)
    angle: float | None = attribute(_ANGLE, default=None)
    activation: float | None = attribute(_ACTIVATION, default=None)
    intensity: float = attribute(AMOUNT, default=0.5)
    profile: str | None = attribute(word, default=None)

    def fault(self) -> str:
        return _one_place(self.name, self.angle, self.activation)


@node
class Expression(Behaviour):
    """Show an expression of the expression library, such as "template:astonishment"."""

    tag = own("expression")
    sync_points = PEAK
    name: str = attribute(word)
    intensity: float = attribute(AMOUNT, default=0.5)


@node
class Fap(Part):
    """One facial animation parameter, in its own unit."""

    tag = own("fap")
    number: int = attribute(integer(3, 68))
    value: float = attribute(_FAPU)


@node
class Faps(Behaviour):
    """Raw facial animation parameters: reached at attackPeak, held to relax."""

    tag = own("faps")
    sync_points = PEAK
    values: tuple[Fap, ...] = children(Fap, least=1)


@node
class FapFile(Behaviour):
    """Play a .fap file of the media folder."""

    tag = own("fapFile")
    file_name: str = attribute(word)


@node
class Blink(Behaviour):
    """One blink, or a wink of one side."""

    tag = own("blink")
    sync_points = PEAK
    side: str = attribute(one_of(*SIDES), default="BOTH")
    amount: float = attribute(AMOUNT, default=1.0)


@node
class Idle(Behaviour):
    """What a face does when it does nothing, from now on.

    Attributes:
        blinks: the part of its usual blinks that it keeps, 0 none.
        motion: the part of its usual small movements of head and eyes, 0 none.
    """

    tag = own("idle")
    blinks: float = attribute(AMOUNT, default=1.0)
    motion: float = attribute(AMOUNT, default=1.0)
