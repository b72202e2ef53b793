"""The values of steps 2 and 3: the timing that a behaviour prefers, and the schedule of a block."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from realizer.core import work
from realizer.core.array_types import Float64

# s; a time that is so much later than the start of its block is not known yet: an open speech ends there.
UNKNOWN = 5e5
# A gap that holds a pose until an unknown time is so much softer than the other gaps of its behaviour.
SOFTER = 1e-6


@dataclass(frozen=True)
class Timing:
    """The timing that one behaviour prefers: k sync points, k-1 gaps."""

    # k sync point names in chronological order, such as ("start", "attackPeak", "relax", "end")
    points: tuple[str, ...]
    preferred: Float64  # (k-1,) float64 seconds, the preferred length of each gap
    least: Float64  # (k-1,) float64 seconds, the least length of each gap
    stiffness: Float64  # (k-1,) float64 > 0, the a of a (t[i+1] - t[i] - preferred[i])^2 (Paul 2010, 3.3.3)
    rigid: bool = False  # every gap has exactly its preferred length; stiffness, least and most are ignored
    # (k-1,) float64 seconds >= least, the greatest length of each gap, inf if there is none; None if no gap
    # has one. With it, least and most take precedence over lengths that the document states; otherwise a
    # stated length takes precedence over the least gaps in it.
    most: Float64 | None = None

    def __post_init__(self) -> None:
        gaps = (len(self.points) - 1,)
        for name in ("preferred", "least", "stiffness", "most"):
            given = getattr(self, name)
            if given is None and name == "most":
                continue
            value = np.asarray(given, np.float64)
            if value.shape != gaps:
                raise ValueError(
                    f"{name}: wanted shape {gaps} for {len(self.points)} points, got {value.shape}"
                )
            object.__setattr__(self, name, value)
        if self.most is not None and not (self.most >= self.least).all():
            raise ValueError(f"most: wanted at least {self.least.tolist()}, got {self.most.tolist()}")

    @property
    def with_hold(self) -> Timing:
        """The timing with a softest gap that can last for days, while the others keep their lengths."""
        if self.rigid:
            return self
        stiffness = self.stiffness.copy()
        stiffness[stiffness.argmin()] *= SOFTER
        return replace(self, stiffness=stiffness)


class Clause(NamedTuple):
    """One clause of a conflict: a statement or gap in words, with its line."""

    id: str
    line: int | None
    text: str


@dataclass(frozen=True, slots=True)
class Warning:  # the standard's word
    """One BML warning: `id` is a block, "block:behaviour" or "block:constraint", `type` the standard's.

    `clash`: the minimal conflict that is the reason, if any. `constraint`: it is about a constraint.
    `in_use_for`: as in `WarningFeedback`.
    """

    id: str
    type: str
    text: str
    clash: tuple[Clause, ...] = ()
    constraint: bool = False
    in_use_for: int | None = None

    def to_json(self) -> dict[str, Any]:
        """Return {"id", "type", "text"}, and "clash": [{"id", "line", "text"}] if there is one."""
        known: dict[str, Any] = {"id": self.id, "type": self.type, "text": self.text}
        if self.clash:
            known["clash"] = [clause._asdict() for clause in self.clash]
        return known


@dataclass(frozen=True)
class Schedule:
    """The sync times of one block.

    Attributes:
        block: the block's id.
        points: behaviour id -> its k sync point names, in order. Dropped behaviours are absent.
        times: behaviour id -> (k,) float64, seconds from block start.
        start: seconds on the session clock; 0 for a block planned on its own.
        warnings: one for each dropped part.
        cost: the sum of a (gap - preferred)^2.
        failed: the whole block was refused (a required part cannot hold); times is empty then.
        lengths: speech -> its points, with "end" -> seconds from its start that would let more of the block
            fit. If there are any, the block was not planned: plan it again with speech of these lengths.
        over_limit: it failed because planning it takes too many steps.
        late: behaviour id -> seconds by which it is later than its references into other blocks say.
        lost_constraints: positions, in the block, of the constraints that were dropped by themselves.
        released: sync points, "behaviour:sync", whose references were given up, so that the behaviours stay.
    """

    block: str
    points: Mapping[str, tuple[str, ...]]
    times: Mapping[str, Float64]
    start: float = 0.0
    warnings: tuple[Warning, ...] = ()
    cost: float = 0.0
    failed: bool = False
    lengths: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    over_limit: bool = False
    late: Mapping[str, float] = field(default_factory=dict)
    lost_constraints: tuple[int, ...] = field(default=(), compare=False)
    released: tuple[str, ...] = field(default=(), compare=False)
    character: str | None = field(default=None, compare=False)

    @cached_property
    def duration(self) -> float:
        """Seconds from block start to the last behaviour's end; 0 for an empty block."""
        return max((float(t[-1]) for t in self.times.values()), default=0.0)

    @property
    def end(self) -> float:
        """When the block ends, on the session clock."""
        return self.start + self.duration

    @property
    def fit(self) -> tuple[int, int]:
        """How much of the block fits: more behaviours are better, then fewer given up references."""
        return len(self.times), -len(self.released)

    @property
    def known(self) -> Schedule:
        """The schedule with infinite times where they are not known yet."""
        if self.duration < UNKNOWN:
            return self
        return replace(self, times={b: np.where(t < UNKNOWN, t, np.inf) for b, t in self.times.items()})

    @property
    def behaviours(self) -> dict[str, dict[str, float]]:
        """{behaviour id: {sync point: seconds from block start}}."""
        return {b: self[b] for b in work.counted(self.times)}

    @property
    def dropped(self) -> tuple[str, ...]:
        """Ids, "block:behaviour", of the behaviours that warnings report as dropped."""
        prefix = f"{self.block}:"
        return tuple(
            w.id
            for w in self.warnings
            if w.id.startswith(prefix)
            and not w.constraint
            and (w.type == "PARSING_FAILURE" or w.id.removeprefix(prefix) not in self.times)
        )

    def at(self, behaviour: str, sync: str) -> float:
        """Return the seconds from block start of one sync point.

        Raises:
            KeyError: no such behaviour (or it was dropped), or no such sync point; the text lists them.
        """
        if behaviour not in self.times:
            raise KeyError(f"{behaviour}: wanted one of {', '.join(self.times) or 'no behaviours'}")
        if sync not in self.points[behaviour]:
            known = ", ".join(self.points[behaviour])
            raise KeyError(f"{behaviour}:{sync}: wanted a sync point of {behaviour}: {known}")
        return float(self.times[behaviour][self.points[behaviour].index(sync)])

    def __getitem__(self, behaviour: str) -> dict[str, float]:
        return dict(zip(self.points[behaviour], self.times[behaviour].tolist(), strict=True))

    def to_json(self) -> dict[str, Any]:
        """Return the JSON of `realizer schedule --json`."""
        return {
            "block": self.block,
            "start": self.start,
            "end": self.end,
            "behaviours": self.behaviours,
            "warnings": [w.to_json() for w in self.warnings],
        }
