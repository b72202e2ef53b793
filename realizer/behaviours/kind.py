"""What a family of behaviours brings: its node, what it wants of time, and what it shows."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from realizer.animation.channel import Channel
from realizer.arrays import Float64
from realizer.scheduling.timing import Timing
from realizer.speech.utterance import Say, Utterance

__all__ = ["Kind", "World"]

Position = tuple[float, float, float]


@dataclass(frozen=True)
class World:
    """What a document cannot know.

    Attributes:
        scene: target name -> (x, y, z) metres, origin between the eyes, +x the character's left, +y up,
            +z forward; None while the session has no scene (then any target is straight ahead).
        utterances: behaviour id -> what the voice made of it.
        language: BCP-47 of speech without its own.
        seed: for anything random.
    """

    scene: Mapping[str, Position] | None = None
    utterances: Mapping[str, Utterance] = field(default_factory=dict)
    language: str = "en-US"
    seed: int = 0


@dataclass(frozen=True)
class Fault:
    """Why a well-formed behaviour cannot or can only partly be played; becomes one BML warning."""

    type: str
    text: str
    fatal: bool = True  # False: it still plays (NO_SUCH_TARGET)


@dataclass(frozen=True)
class Kind:
    """One behaviour element.

    Attributes:
        node: its class in `bml_schema` (core) or in the module itself (extension); `node.tag` is its name.
        timing: (node, world) -> Timing, step 2. A speech needs `world.utterances[node.id]`.
        expand: (node, times (k,) seconds from block start, world) -> Channels, step 4. Times follow
            `timing(...).points`. Body behaviours show nothing on a face: ().
        check: (node, world) -> faults: unknown lexeme or AU, no such target. Run before timing.
        say: (node, world) -> what the voice has to say, or None. Only speech has it.
        region: a base state this behaviour replaces for good at its end ("eyes", "head", "face"); for the
            *Shift behaviours, whose channels have `holds=True`.
    """

    node: type[Any]
    timing: Callable[[Any, World], Timing]
    expand: Callable[[Any, Float64, World], tuple[Channel, ...]]
    check: Callable[[Any, World], tuple[Fault, ...]] = lambda node, world: ()
    say: Callable[[Any, World], Say | None] | None = None
    region: str | None = None

    @property
    def tag(self) -> str:
        tag: str = self.node.tag
        return tag
