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
    """Interrupt a block, or some of its behaviours, at `start`.

    Attributes:
        target: the block.
        include: only these behaviours; () for all.
        exclude: all but these behaviours.
    """

    tag = bmla("interrupt")
    target: str = attribute(block_name)
    include: tuple[str, ...] = attribute(names, default=())
    exclude: tuple[str, ...] = attribute(names, default=())


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
    """Change a parameter of a playing behaviour, such as its amount or volume.

    Attributes:
        target: (block, behaviour).
        param_id: its name; which parameters exist depends on the behaviour.
    """

    tag = bmla("parametervaluechange")
    target: tuple[str, str] = attribute(behaviour_name)
    param_id: str = attribute(word)
    trajectory: Trajectory = child(Trajectory)


@node
class AudioFile(Behaviour):
    """Play a sound file of the media folder."""

    tag = bmlt("audiofile")
    file_name: str = attribute(word)


@node
class FaceInterpolator(Part):
    """Keys of several parts of a face.

    Attributes:
        parts: "31 32" FAP numbers, or "1.BOTH 12.LEFT" action units.
        keys: a line for each key: its time in seconds, then one value for each part.
    """

    tag = bmlt("FaceInterpolator")
    parts: str = attribute(word)
    keys: str = text(default="")


@node
class FaceKeyframe(Behaviour):
    """A face animation by keys: FAPs in their units, or action units 0..1."""

    tag = bmlt("facekeyframe")
    type: str = attribute(one_of("MORPH", "FAPS", "FACS"), default="MORPH")
    name: str | None = attribute(word, default=None)
    interpolator: FaceInterpolator | None = child(FaceInterpolator, default=None)
