"""Exclusive resources of behaviours (gaze, head, speech ...), and conflicts over them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import inf

from bml_schema import Block, Interrupt
from realizer.behaviours.kind import BehaviourKind, PlanningContext
from realizer.scheduling.timing import Schedule

# s; two claims may overlap by this much.
TOUCH = 1e-3
# s; two speeches that overlap by less are placed one after the other, if there is a way.
SMALL = 0.3
# Resources that may pass from one behaviour to the next: two conflict only if one lies within the other. A
# gaze does not pass to another block, which must not disturb it; a base state does, or it would never change.
PASSES = {"gaze": "own block", "base gaze": "any block", "base head": "any block", "base face": "any block"}


@dataclass(frozen=True, slots=True)
class ResourceClaim:
    """A claim of a behaviour on an exclusive resource for some time.

    Attributes:
        resource: such as "voice" or "gaze"; of one character.
        begin, end: seconds; all compared claims are on the same clock.
        block, behaviour: the claimant.
        rank: of two behaviours in one block the one of lower rank wins.
        silent_from: when its closing silence begins; infinite for what is no sound.
    """

    resource: str
    begin: float
    end: float
    block: str
    behaviour: str
    rank: tuple[float, bool, int] = (0.0, False, 0)
    silent_from: float = inf

    def shifted(self, seconds: float) -> ResourceClaim:
        """Return the same claim, later by `seconds`."""
        return replace(
            self,
            begin=self.begin + seconds,
            end=self.end + seconds,
            silent_from=self.silent_from + seconds,
        )

    def conflicts_with(self, other: ResourceClaim) -> bool:
        """Whether one of the two has to be dropped."""
        if self.resource != other.resource:
            return False
        first, second = (self, other) if self.begin <= other.begin else (other, self)
        # Another block may speak in the closing silence of a speech.
        until = first.end if first.block == second.block else min(first.end, first.silent_from)
        if min(until, second.end) - second.begin <= TOUCH:
            return False
        passes = PASSES.get(self.resource)
        if passes is None or (passes == "own block" and self.block != other.block):
            return True
        inner, outer = sorted((self, other), key=lambda c: c.end - c.begin)
        return outer.begin <= inner.begin + TOUCH and inner.end <= outer.end + TOUCH


@dataclass(frozen=True, slots=True)
class ResourceConflict:
    """A claim that is refused, and the claim that it conflicts with."""

    claim: ResourceClaim
    winner: ResourceClaim
    start: float = 0.0  # of the block that loses it

    @property
    def sequence(self) -> tuple[str | float, str | float] | None:
        """The order of two speeches that overlap only a little, or None.

        A behaviour of the losing block is given by its id, one of another block by the time at which it ends
        or begins, in seconds from the start of the losing block.
        """
        first, second = sorted((self.claim, self.winner), key=lambda c: c.begin)
        own = self.claim.block
        audible = min(first.end, first.silent_from)
        within = second.begin <= first.begin + TOUCH or second.end <= audible
        if self.claim.resource != "voice" or within or audible - second.begin >= SMALL:
            return None
        until = first.end if first.block == own else audible
        return (
            first.behaviour if first.block == own else until - self.start,
            second.behaviour if second.block == own else second.begin - self.start,
        )

    def __str__(self) -> str:
        """Return `wanted the gaze from 1 to 2.5 s, g1 has it from 0 to 1.5 s`, from block start."""
        w, c = self.winner, self.claim
        own = w.behaviour if w.block == c.block else f"{w.block}:{w.behaviour}"
        begin, end, since, until = (f"{round(t - self.start, 3):g}" for t in (c.begin, c.end, w.begin, w.end))
        return f"wanted the {c.resource} from {begin} to {end} s, but {own} has it from {since} to {until} s"


def claims(
    block: Block, schedule: Schedule, kinds: Mapping[str, BehaviourKind], context: PlanningContext
) -> Iterator[ResourceClaim]:
    """Yield the claims of the scheduled behaviours of a block, on the clock of `schedule.start`."""
    for order, node in enumerate(block.behaviours):
        wanted = kinds[node.tag].claims(node, context) if node.id in schedule.times else ()
        if not wanted:
            continue
        points, times = schedule.points[node.id], schedule.times[node.id]
        last = points.index("relax") if "relax" in points else -1
        begin, end = schedule.start + float(times[0]), schedule.start + float(times[last])
        rank = (-node.priority, node.id not in block.required, order)
        sound = kinds[node.tag].sound(node, context)
        silent_from = inf if sound is None else begin + sound.silent_from
        for resource in sorted(wanted):
            yield ResourceClaim(resource, begin, end, block.id, node.id, rank, silent_from)


def interrupts(block: Block, schedule: Schedule) -> Iterator[tuple[float, Interrupt]]:
    """Yield the interrupts that a block will make, each with its time on the clock of `schedule.start`."""
    for node in block.behaviours:
        if isinstance(node, Interrupt) and node.id in schedule.times:
            yield schedule.start + float(schedule.times[node.id][0]), node


def after_interrupts(
    existing_claims: Iterable[ResourceClaim], promised: Iterable[tuple[float, Interrupt]]
) -> list[ResourceClaim]:
    """Return claims as they are once interrupts, each at its time, have been made."""
    ends: dict[str, list[tuple[float, Interrupt]]] = {}
    for time, act in promised:
        ends.setdefault(act.target, []).append((time, act))
    if not ends:
        return list(existing_claims)
    left: list[ResourceClaim] = []
    for claim in existing_claims:
        cuts = [time for time, act in ends.get(claim.block, ()) if _ends(act, claim.behaviour)]
        end = min([claim.end, *cuts])
        if end > claim.begin:
            left.append(claim if end == claim.end else replace(claim, end=end))
    return left


def _ends(act: Interrupt, behaviour: str) -> bool:
    return behaviour not in act.exclude and (not act.include or behaviour in act.include)


def trims(
    new_claims: Iterable[ResourceClaim], existing_claims: Iterable[ResourceClaim]
) -> Iterator[tuple[tuple[str, str], float]]:
    """Yield (block, behaviour) and new end of the speeches whose closing silence a new speech overlaps."""
    begins = [claim.begin for claim in new_claims if claim.resource == "voice"]
    for claim in existing_claims if begins else ():
        cuts = [t for t in begins if claim.begin < t < claim.end] if claim.resource == "voice" else []
        if cuts:
            yield (claim.block, claim.behaviour), max(min(cuts), claim.silent_from)


def conflicts(
    new_claims: Iterable[ResourceClaim], existing_claims: Iterable[ResourceClaim], start: float = 0.0
) -> list[ResourceConflict]:
    """Return the conflicts of new claims: existing ones win, then those of lower rank.

    There is one conflict a behaviour, in order of rank. The times in messages count from `start`.
    """
    had: dict[str, list[ResourceClaim]] = {}
    for claim in existing_claims:
        had.setdefault(claim.resource, []).append(claim)
    by_behaviour: dict[str, list[ResourceClaim]] = {}
    for claim in sorted(new_claims, key=lambda c: c.rank):
        by_behaviour.setdefault(claim.behaviour, []).append(claim)
    lost: list[ResourceConflict] = []
    for own in by_behaviour.values():
        clash = ((c, h) for c in own for h in had.get(c.resource, ()) if h.conflicts_with(c))
        if (conflict := next(clash, None)) is not None:
            lost.append(ResourceConflict(*conflict, start))
            continue
        for claim in own:
            had.setdefault(claim.resource, []).append(claim)
    return lost
