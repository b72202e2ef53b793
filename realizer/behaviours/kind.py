"""The interface of behaviours: timing and expansion of a node class, and the context of planning."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from bml_schema import Activate, Interrupt, ParameterValueChange
from realizer.animation.channel import Channel
from realizer.core.array_types import Float64
from realizer.core.options import DEFAULTS
from realizer.expressions.library import Library, builtin
from realizer.scheduling.timing import Timing
from realizer.speech.utterance import Recording, SpeechRequest, Utterance
from realizer.tables.timing import Gap, gaps

Position = tuple[float, float, float]


@dataclass(frozen=True)
class PlanningContext:
    """The settings and data that planning needs besides the document."""

    # target name -> (x, y, z) metres, origin between the eyes, +x the character's left, +y up, +z forward;
    # None while the session has no scene (then any target is straight ahead)
    scene: Mapping[str, Position] | None = None
    utterances: Mapping[str, Utterance] = field(default_factory=dict)  # behaviour id -> its utterance
    language: str = "en-US"  # BCP-47 of speech without its own
    # jaw, lips: how far the jaw and the lips move in speech without its own style (`LipStyle`)
    jaw: float = 1.0
    lips: float = 1.0
    seed: int = 0  # for random choices
    media: Path | None = None  # the folder of the files that documents can name, or None
    # id -> sound of a client, which documents name as `clip:ID`
    clips: Mapping[str, Recording] = field(default_factory=dict)
    library: Library = field(default_factory=builtin)  # the expressions that documents can name
    # () -> the inputs of the character's face (`Face.inputs`), or None if unknown
    face_inputs: Callable[[], Sequence[str] | None] = lambda: None
    grace: float = 0.0  # seconds by which a behaviour may come too late for its references into other blocks
    max_planning: int = DEFAULTS.max_planning  # steps of planning a block
    # 0..1, how much expressions vary as people's do; 0: sides are equal, holds are still
    liveliness: float = 0.0
    animates: bool = True  # whether behaviours are expanded and played; False if only their times are wanted
    sender: int | None = None  # number of the connection that the block came by


# What a behaviour does to other blocks and behaviours when it starts.
BlockCommand = Interrupt | Activate | ParameterValueChange


@dataclass(frozen=True)
class Fault:
    """A reason why a behaviour cannot or can only partly be played; it becomes one BML warning."""

    type: str
    text: str
    fatal: bool = True  # False: it still plays (NO_SUCH_TARGET)


@dataclass(frozen=True)
class BehaviourKind:
    """The functions that play one behaviour element."""

    # its class in `bml_schema` (core) or in the module itself (extension); `node.tag` is its name
    node: type[Any]
    # (node, context) -> Timing, step 2. A speech needs `context.utterances[node.id]`.
    timing: Callable[[Any, PlanningContext], Timing]
    # (node, times (k,) seconds from block start, context) -> Channels, step 4. Times follow
    # `timing(...).points`. By default the face does not move.
    expand: Callable[[Any, Float64, PlanningContext], tuple[Channel, ...]] = lambda node, times, context: ()
    # (node, context) -> faults: unknown lexeme or AU, no such target. Called before timing.
    check: Callable[[Any, PlanningContext], tuple[Fault, ...]] = lambda node, context: ()
    # (node, context) -> the request to the voice, or None. Only for speech.
    speech_request: Callable[[Any, PlanningContext], SpeechRequest | None] | None = None
    command: Callable[[Any], BlockCommand] | None = None  # node -> its command to other blocks and behaviours
    # (node, context) -> Timing of a rigid behaviour that can stretch if nothing else helps, or None
    stretch: Callable[[Any, PlanningContext], Timing | None] = lambda node, context: None
    # (node, context) -> its sound from start to end, or None
    sound: Callable[[Any, PlanningContext], Utterance | None] = lambda node, context: None
    # (node, times (k,) seconds from block start) -> how its times differ from what the document says, in
    # words, or "". Called after scheduling.
    review: Callable[[Any, Float64], str] | None = None
    # (node, context) -> exclusive resources ("voice", "gaze", "head pitch") that it needs from start to relax
    # (to end if it has no relax): of two behaviours of a character with the same claim at one time one is
    # dropped. Expressions have no claims: they blend.
    claims: Callable[[Any, PlanningContext], frozenset[str]] = lambda node, context: frozenset()
    # parameter that can change while it plays -> the field with its initial value, or that value. "volume"
    # scales its sound, all others its channels.
    parameters: Mapping[str, str | float] = field(default_factory=dict)
    # the base state that this behaviour replaces permanently ("eyes", "head", "face"); for the *Shift
    # behaviours, whose channels have `keeps_last=True`
    region: str | None = None

    @property
    def tag(self) -> str:
        tag: str = self.node.tag
        return tag


def claiming(resource: str) -> Callable[[Any, PlanningContext], frozenset[str]]:
    """Return the function `claims` of a behaviour that always needs one resource."""
    return lambda node, context: frozenset({resource})


def timing_from_table(element: str, variant: str = "") -> Timing:
    """Return the timing of an element; a `variant` is a lexeme or an influence with a timing of its own."""
    row = gaps(element, variant)
    return from_gaps(row.points, row.gaps)


def table_timing(element: str, variant: str = "") -> Callable[[Any, PlanningContext], Timing]:
    """Return the function `timing` of a behaviour whose timing is always that of one row of the table."""
    return lambda node, context: timing_from_table(element, variant)


@lru_cache(maxsize=1000)
def from_gaps(points: tuple[str, ...], gaps: tuple[Gap, ...]) -> Timing:
    """Return the timing of k points and the k-1 gaps between them."""
    rows = np.array([(gap.preferred, gap.least, gap.stiffness) for gap in gaps]).T
    rows.setflags(write=False)  # shared by all behaviours of a kind
    return Timing(points, *rows)
