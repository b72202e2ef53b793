"""The behaviours of BMLA and BMLT (AsapRealizer, Elckerlyc) that concern a face."""

from bml_schema.node_schema import attribute, child, node, text
from bml_schema.nodes import Behaviour, Part, bmla, bmlt
from bml_schema.values import Value, block_name, name, names, number, one_of, word


def _read_target(text: str) -> tuple[str, str]:
    block, _, behaviour = text.strip().partition(":")
    return block_name.read(block), name.read(behaviour)


# Another block's behaviour, as feedback names it.
behaviour_name = Value("block:behaviour", _read_target, ":".join, "behaviourName")


@node
class Interrupt(Behaviour):
    """Interrupt a block, or some of its behaviours, at `start`."""

    tag = bmla("interrupt")
    target: str = attribute(block_name)  # the block
    include: tuple[str, ...] = attribute(names, default=())  # only these behaviours; () for all
    exclude: tuple[str, ...] = attribute(names, default=())  # all but these behaviours


@node
class Activate(Behaviour):
    """Start a preplanned block at `start`."""

    tag = bmla("activate")
    target: str = attribute(block_name)


@node
class Trajectory(Part):
    """The course of a parameter to its new value: at once, or linear from start to end."""

    tag = bmla("trajectory")
    type: str = attribute(one_of("linear", "instant"))
    initial_value: float | None = attribute(number(-1e6, 1e6), default=None)
    target_value: float = attribute(number(-1e6, 1e6))


@node
class ParameterValueChange(Behaviour):
    """Change a parameter of a playing behaviour, such as its amount or volume."""

    tag = bmla("parametervaluechange")
    target: tuple[str, str] = attribute(behaviour_name)  # (block, behaviour)
    param_id: str = attribute(word)  # its name; which parameters exist depends on the behaviour
    trajectory: Trajectory = child(Trajectory)


@node
class BlinkEmitter(Behaviour):
    """Blink again and again, about every `avg_waiting_time` seconds, give or take `range`."""

    tag = bmlt("blinkemitter")
    avg_waiting_time: float = attribute(number(0.1, 86400), default=5.0, name="avgwaitingtime")
    range: float = attribute(number(0, 86400), default=0.0)


@node
class AudioFile(Behaviour):
    """Play a sound file of the media folder."""

    tag = bmlt("audiofile")
    file_name: str = attribute(word)


@node
class FaceInterpolator(Part):
    """Keys of several parts of a face."""

    tag = bmlt("FaceInterpolator")
    parts: str = attribute(word)  # "31 32" FAP numbers, or "1.BOTH 12.LEFT" action units
    keys: str = text(default="")  # a line for each key: its time in seconds, then one value for each part


@node
class FaceKeyframe(Behaviour):
    """A face animation by keys: FAPs in their units, or action units 0..1."""

    tag = bmlt("facekeyframe")
    type: str = attribute(one_of("MORPH", "FAPS", "FACS"), default="MORPH")
    name: str | None = attribute(word, default=None)
    interpolator: FaceInterpolator | None = child(FaceInterpolator, default=None)
