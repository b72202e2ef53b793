"""Exclusive resources of behaviours (gaze, head, speech ...), and conflicts over them."""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import count
from math import inf
from operator import itemgetter

from bml_schema import Block, Interrupt
from realizer.behaviours.kind import BehaviourKind, PlanningContext
from realizer.core import work
from realizer.scheduling.timing import Schedule

# s; two claims may overlap by this much.
MAX_OVERLAP = 1e-3
# s; two speeches that overlap by less are placed one after the other, if their references allow it.
MAX_SHIFT = 0.3
# Up to so many overlapping claims, the first that was granted is named as the reason.
MANY = 50
# Resources that may pass from one behaviour to the next: two claims conflict only if one contains the other.
# A gaze passes only within its block, because other blocks must not disturb it; a base state passes to any
# block, or it could never change.
PASSES = {"gaze": "own block", "base gaze": "any block", "base head": "any block", "base face": "any block"}


@dataclass(frozen=True, slots=True)
class ResourceClaim:
    """A claim of a behaviour on an exclusive resource for some time."""

    resource: str  # such as "voice" or "gaze"; of one character
    # begin, end: seconds; all compared claims are on the same clock
    begin: float
    end: float
    # block, behaviour: the claimant
    block: str
    behaviour: str
    # of two behaviours in one block the one with the lower rank wins
    rank: tuple[float, bool, int] = (0.0, False, 0)
    silent_from: float = inf  # when the final silence of its sound begins; infinite without sound

    def shifted(self, seconds: float) -> ResourceClaim:
        return replace(
            self, begin=self.begin + seconds, end=self.end + seconds, silent_from=self.silent_from + seconds
        )

    def conflicts_with(self, other: ResourceClaim, *, in_silence: bool = True) -> bool:
        """Return whether one of the two has to be dropped.

        With `in_silence`, a speech may begin in the final silence of another speech of its block.
        """
        if self.resource != other.resource:
            return False
        first, second = (self, other) if self.begin <= other.begin else (other, self)
        # Another block may always speak during the final silence of a speech.
        may_overlap = in_silence or first.block != second.block
        until = min(first.end, first.silent_from) if may_overlap else first.end
        if min(until, second.end) - second.begin <= MAX_OVERLAP:
            return False
        passes = PASSES.get(self.resource)
        if passes is None or (passes == "own block" and self.block != other.block):
            return True
        inner, outer = sorted((self, other), key=lambda c: c.end - c.begin)
        return outer.begin <= inner.begin + MAX_OVERLAP and inner.end <= outer.end + MAX_OVERLAP


@dataclass(frozen=True, slots=True)
class ResourceConflict:
    """A claim that is refused, and the claim that it conflicts with."""

    claim: ResourceClaim
    winner: ResourceClaim
    start: float = 0.0  # start of the block of `claim`

    @property
    def sequence(self) -> tuple[str | float, str | float] | None:
        """The order of two speeches that overlap only a little, or None.

        A behaviour of the losing block is given by its id, one of another block by the time at which it ends
        or begins, in seconds from the start of the losing block.
        """
        first, second = sorted((self.claim, self.winner), key=lambda c: c.begin)
        own = self.claim.block
        audible = min(first.end, first.silent_from)
        within = second.begin <= first.begin + MAX_OVERLAP or second.end <= audible
        if self.claim.resource != "voice" or within or audible - second.begin >= MAX_SHIFT:
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
    for order, node in enumerate(work.counted(block.behaviours, 5)):
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
    existing_claims: Iterable[ResourceClaim], planned: Iterable[tuple[float, Interrupt]]
) -> list[ResourceClaim]:
    """Return the claims that remain when interrupts end behaviours, each at its time."""
    by_block: dict[str, list[tuple[float, Interrupt]]] = {}
    for time, interrupt in planned:
        by_block.setdefault(interrupt.target, []).append((time, interrupt))
    if not by_block:
        return list(existing_claims)
    remaining: list[ResourceClaim] = []
    for claim in existing_claims:
        of_block = by_block.get(claim.block, ())
        end = min([claim.end, *(time for time, interrupt in of_block if _ends(interrupt, claim.behaviour))])
        if end > claim.begin:
            remaining.append(claim if end == claim.end else replace(claim, end=end))
    return remaining


def _ends(interrupt: Interrupt, behaviour: str) -> bool:
    included = not interrupt.include or behaviour in interrupt.include
    return included and behaviour not in interrupt.exclude


def trims(
    new_claims: Iterable[ResourceClaim], existing_claims: Iterable[ResourceClaim]
) -> Iterator[tuple[tuple[str, str], float]]:
    """Yield ((block, behaviour), new end) of each speech whose final silence a new speech overlaps."""
    begins = [claim.begin for claim in new_claims if claim.resource == "voice"]
    for claim in existing_claims if begins else ():
        cuts = [t for t in begins if claim.begin < t < claim.end] if claim.resource == "voice" else []
        if cuts:
            yield (claim.block, claim.behaviour), max(min(cuts), claim.silent_from)


def conflicts(
    new_claims: Iterable[ResourceClaim],
    existing_claims: Iterable[ResourceClaim],
    start: float = 0.0,
    *,
    in_silence: bool = True,
) -> list[ResourceConflict]:
    """Return the conflicts of new claims, at most one for each behaviour, in order of rank.

    Existing claims win against new ones, and lower ranks against higher ones. The times in messages count
    from `start`. For `in_silence` see `ResourceClaim.conflicts_with`.
    """
    granted: dict[str, dict[str, _ClaimsOfBlock]] = {}
    number = count()

    def add(claim: ResourceClaim) -> None:
        granted.setdefault(claim.resource, {}).setdefault(claim.block, _ClaimsOfBlock()).add(
            next(number), claim
        )

    for claim in existing_claims:
        add(claim)
    by_behaviour: dict[str, list[ResourceClaim]] = {}
    for claim in sorted(new_claims, key=lambda c: c.rank):
        by_behaviour.setdefault(claim.behaviour, []).append(claim)
    found: list[ResourceConflict] = []
    for own in work.counted(by_behaviour.values(), 5):
        for claim in own:
            blocks = granted.get(claim.resource, {}).values()
            winners = [winner for block in blocks for winner in block.winners(claim, in_silence)]
            if winners:
                found.append(ResourceConflict(claim, min(winners, key=itemgetter(0))[1], start))
                break
        else:
            for claim in own:
                add(claim)
    return found


class _ClaimsOfBlock:
    """The claims of a block on a resource, by their begins.

    The claims of a block do not lie within each other, or one would have been dropped: so their ends are in
    the same order. The few that do, because they were cut off, are compared one by one.
    """

    def __init__(self) -> None:
        self._begins: list[float] = []
        self._claims: list[tuple[int, ResourceClaim]] = []  # in the order of their begins
        self._nested: list[tuple[int, ResourceClaim]] = []

    def add(self, number: int, claim: ResourceClaim) -> None:
        """Add a claim with its number, the order in which claims win."""
        place = bisect_right(self._begins, claim.begin)
        follows = place == 0 or self._claims[place - 1][1].end <= claim.end
        if follows and (place == len(self._claims) or claim.end <= self._claims[place][1].end):
            self._begins.insert(place, claim.begin)
            self._claims.insert(place, (number, claim))
        else:
            self._nested.append((number, claim))

    def winners(self, claim: ResourceClaim, in_silence: bool) -> list[tuple[int, ResourceClaim]]:
        """Return claims, with their numbers, because of which a new claim is refused.

        If it overlaps very many they are not all compared: if any wins, one that begins first or last does,
        or one that begins about when the new claim does.
        """
        low = bisect_left(self._claims, claim.begin, key=lambda numbered: numbered[1].end)
        high = bisect_left(self._begins, claim.end)
        places: Iterable[int] = range(low, high)
        if len(range(low, high)) > MANY:
            near = bisect_left(self._begins, claim.begin)
            places = sorted({low, low + 1, high - 1, *range(max(near - 2, low), min(near + 2, high))})
        overlapping = (*(self._claims[place] for place in places), *self._nested)
        return [
            numbered for numbered in overlapping if numbered[1].conflicts_with(claim, in_silence=in_silence)
        ]
