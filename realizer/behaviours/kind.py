"""The behaviour kind: node class, timing and expansion; and the context of planning."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from realizer.animation.channel import Channel
from realizer.core.array_types import Float64
from realizer.expressions.library import Library, builtin
from realizer.scheduling.timing import Timing
from realizer.speech.utterance import Recording, SpeechRequest, Utterance

Position = tuple[float, float, float]


@dataclass(frozen=True)
class PlanningContext:
    """What a document cannot know.

    Attributes:
        scene: target name -> (x, y, z) metres, origin between the eyes, +x the character's left, +y up,
            +z forward; None while the session has no scene (then any target is straight ahead).
        utterances: behaviour id -> what the voice made of it.
        language: BCP-47 of speech without its own.
        seed: for anything random.
        media: the folder that holds the files documents may name; None: there are none.
        clips: id -> sound that a client sent, which documents name as `clip:ID`.
        library: the expressions that documents may name.
        face_inputs: () -> what moves the character's face (`Face.takes`); None where that is not known.
    """

    scene: Mapping[str, Position] | None = None
    utterances: Mapping[str, Utterance] = field(default_factory=dict)
    language: str = "en-US"
    seed: int = 0
    media: Path | None = None
    clips: Mapping[str, Recording] = field(default_factory=dict)
    library: Library = field(default_factory=builtin)
    face_inputs: Callable[[], Sequence[str] | None] = lambda: None


@dataclass(frozen=True)
class Interrupt:
    """End a block, or those of its behaviours that are in `include` (None: all) and not in `exclude`."""

    block: str
    include: frozenset[str] | None = None
    exclude: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Activate:
    """Start a preplanned block."""

    block: str


@dataclass(frozen=True)
class Change:
    """Let a parameter of a behaviour go to `to`, from `initial` (None: from where it is), by a curve.

    At once where `curve` is None, otherwise from the start of the behaviour that does it to its end.
    """

    block: str
    behaviour: str
    parameter: str
    to: float
    initial: float | None = None
    curve: str | None = None


# What a behaviour does to others when it starts.
BlockCommand = Interrupt | Activate | Change


@dataclass(frozen=True)
class Fault:
    """Why a well-formed behaviour cannot or can only partly be played; becomes one BML warning."""

    type: str
    text: str
    fatal: bool = True  # False: it still plays (NO_SUCH_TARGET)


@dataclass(frozen=True)
class BehaviourKind:
    """One behaviour element.

    Attributes:
        node: its class in `bml_schema` (core) or in the module itself (extension); `node.tag` is its name.
        timing: (node, world) -> Timing, step 2. A speech needs `world.utterances[node.id]`.
        expand: (node, times (k,) seconds from block start, world) -> Channels, step 4. Times follow
            `timing(...).points`. Body behaviours show nothing on a face: ().
        check: (node, world) -> faults: unknown lexeme or AU, no such target. Run before timing.
        speech_request: (node, world) -> what the voice has to say, or None. Only speech has it.
        command: node -> what it does to other blocks and behaviours when it starts.
        stretch: (node, world) -> Timing of a rigid behaviour that can be made to fit others where nothing
            else helps; None where it cannot.
        sound: (node, world) -> what sounds from its start to its end; None where it is silent.
        claims: (node, world) -> names of what it needs for itself ("voice", "gaze", "head pitch") from its
            start to its relax (its end where it has none): of two behaviours of a character that claim the
            same at one time one is dropped. Expressions claim nothing: they blend.
        parameters: name of a parameter that can be changed while it plays -> the field that says its value at
            the beginning, or that value. "volume" scales its sound, all others what it shows.
        region: a base state this behaviour replaces for good at its end ("eyes", "head", "face"); for the
            *Shift behaviours, whose channels have `holds=True`.
    """

    node: type[Any]
    timing: Callable[[Any, PlanningContext], Timing]
    expand: Callable[[Any, Float64, PlanningContext], tuple[Channel, ...]]
    check: Callable[[Any, PlanningContext], tuple[Fault, ...]] = lambda node, context: ()
    speech_request: Callable[[Any, PlanningContext], SpeechRequest | None] | None = None
    command: Callable[[Any], BlockCommand] | None = None
    stretch: Callable[[Any, PlanningContext], Timing | None] = lambda node, context: None
    sound: Callable[[Any, PlanningContext], Utterance | None] = lambda node, context: None
    claims: Callable[[Any, PlanningContext], frozenset[str]] = lambda node, context: frozenset()
    parameters: Mapping[str, str | float] = field(default_factory=dict)
    region: str | None = None

    @property
    def tag(self) -> str:
        tag: str = self.node.tag
        return tag
