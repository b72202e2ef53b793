"""The behaviours that this project adds to BML, in the namespace `urn:bml-realizer:1`."""

from bml_schema.behaviours import AMOUNT, PEAK, SIDES
from bml_schema.node_schema import attribute, children, node
from bml_schema.nodes import Behaviour, Part, own
from bml_schema.values import integer, number, one_of, string, word

_ANGLE = number(-1e6, 1e6, wanted="degrees")  # on the wheel of emotions; full turns are ignored
_AFFECT = number(-1, 1)
_SEED = integer(0, 2**31 - 1)
_ACTIVATION = number(0, 7)  # 7 is the maximum on Paul's scale of Whissel's words
_FAPU = number(-1e5, 1e5)
EYES = ("WAITING", "LISTENING", "THINKING")


@node
class EmotionBase(Behaviour):
    """The attributes that emotion and mood share.

    Attributes:
        name: an emotion word, or an archetype with the number of one of its profiles ("fear 8").
        angle, activation: instead of a word, a place on the wheel; activation 0..7, None for the angle's own.
        valence, arousal: instead of both, a place between pleasant and unpleasant, calm and excited.
        intensity: 0..1 of the full strength of the word or place.
        profile: name of the set of profiles; None for the default.
        seed: for a random face within the ranges of the profile; None for their centres.
    """

    name: str | None = attribute(word, default=None)
    angle: float | None = attribute(_ANGLE, default=None)
    activation: float | None = attribute(_ACTIVATION, default=None)
    valence: float | None = attribute(_AFFECT, default=None)
    arousal: float | None = attribute(_AFFECT, default=None)
    intensity: float = attribute(AMOUNT, default=1.0)
    profile: str | None = attribute(word, default=None)
    seed: int | None = attribute(_SEED, default=None)

    def fault(self) -> str:
        affect = {"valence": self.valence, "arousal": self.arousal}
        ways = {"a name": self.name, "an angle": self.angle, **affect}
        given = [way for way, value in ways.items() if value is not None]
        if given not in (["a name"], ["an angle"], [*affect]):
            got = " and ".join(given) or "none of them"
            return f"wanted one of a name, an angle, or valence with arousal, got {got}"
        if self.activation is not None and self.angle is None:
            return "activation: wanted an angle with it, got none"
        return ""


@node
class Emotion(EmotionBase):
    """Show an emotion for a while."""

    tag = own("emotion")
    sync_points = PEAK


@node
class Mood(EmotionBase):
    """An emotion that is the resting face from now on."""

    tag = own("mood")


@node
class Expression(Behaviour):
    """Show an expression of the expression library, such as "template:astonishment".

    Attributes:
        because: the reason for it, for readers of the document.
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
    """Play a file of the media folder with a sequence of expressions in several channels."""

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
    """The idle motion of a face from now on.

    Attributes:
        blinks: the share of its usual blinks, 0 for none.
        motion: the share of its usual small movements, 0 for none.
        liveliness: of these, the share of breathing, drift of the posture, small movements of the face and
            swallows.
        eyes: whether they move as usual, as those of a listener, or of someone who thinks.
    """

    tag = own("idle")
    blinks: float = attribute(AMOUNT, default=1.0)
    motion: float = attribute(AMOUNT, default=1.0)
    liveliness: float = attribute(AMOUNT, default=1.0)
    eyes: str = attribute(one_of(*EYES), default="WAITING")


@node
class Listen(Behaviour):
    """Respond as a listener does: nods, raised brows, small smiles.

    Attributes:
        intensity: how often and how much; 0 for not at all.
    """

    tag = own("listen")
    intensity: float = attribute(AMOUNT, default=0.5)
