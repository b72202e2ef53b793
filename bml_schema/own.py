"""The behaviours that this project adds to BML, in its own namespace `urn:bml-realizer:1`."""

from __future__ import annotations

from bml_schema.behaviours import AMOUNT, PEAK, SIDES
from bml_schema.nodes import Behaviour, Part, own
from bml_schema.shape import attribute, children, node
from bml_schema.values import integer, number, one_of, string, word

__all__ = ["Blink", "Emotion", "Expression", "Fap", "FapFile", "Faps", "Idle", "Mood", "Timeline"]

_ANGLE = number(-360, 360)  # degrees on the wheel of emotions
_ACTIVATION = number(0, 7)  # 7 is all of an emotion, as Paul scales Whissel
_FAPU = number(-1e5, 1e5)


@node
class Feeling(Behaviour):
    """What an emotion and a mood say alike.

    Attributes:
        name: its word.
        angle, activation: instead of a word, its place on the wheel; activation 0..7, None the angle's own.
        intensity: 0.5 moderate, 1 maximal.
        profile: which of several ways to show it; None the usual one.
    """

    name: str | None = attribute(word, default=None)
    angle: float | None = attribute(_ANGLE, default=None)
    activation: float | None = attribute(_ACTIVATION, default=None)
    intensity: float = attribute(AMOUNT, default=0.5)
    profile: str | None = attribute(word, default=None)

    def fault(self) -> str:
        if (self.name is None) == (self.angle is None):
            got = "neither" if self.name is None else "both"
            return f"wanted a name, or an angle on the wheel, got {got}"
        if self.activation is not None and self.angle is None:
            return "activation: wanted an angle with it, got none"
        return ""


@node
class Emotion(Feeling):
    """Show an emotion for a while."""

    tag = own("emotion")
    sync_points = PEAK


@node
class Mood(Feeling):
    """An emotion that is the resting face from now on."""

    tag = own("mood")


@node
class Expression(Behaviour):
    """Show an expression of the expression library, such as "template:astonishment".

    Attributes:
        because: what placed it, in words; for whoever reads the document.
    """

    tag = own("expression")
    sync_points = PEAK
    name: str = attribute(word)
    intensity: float = attribute(AMOUNT, default=0.5)
    because: str | None = attribute(string, default=None)


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
class Timeline(Behaviour):
    """Play a file of the media folder that has expressions one after the other, in several channels."""

    tag = own("timeline")
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
