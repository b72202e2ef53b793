"""Tests of exclusive resources."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bml_schema import Interrupt, parse
from realizer.behaviours.registry import VOCABULARY
from realizer.playback import resources
from realizer.playback.resources import (
    PASSES,
    ResourceClaim,
    ResourceConflict,
    after_interrupts,
    conflicts,
    interrupts,
    trims,
)
from realizer.scheduling.timing import Schedule


def claim(
    name: str, begin: float, end: float, *, what: str = "voice", block: str = "b", rank: int = 0
) -> ResourceClaim:
    return ResourceClaim(what, begin, end, block, name, (0.0, False, rank))


def lost(wanted: list[ResourceClaim], held: list[ResourceClaim] | None = None) -> list[str]:
    return [loss.claim.behaviour for loss in conflicts(wanted, held or [])]


def test_conflicts_drop_the_later_of_two_that_claim_the_voice() -> None:
    assert lost([claim("a", 0, 2), claim("b", 1, 3, rank=1)]) == ["b"]


def test_conflicts_allow_claims_that_touch() -> None:
    assert lost([claim("a", 0, 2), claim("b", 2, 3, rank=1)]) == []


def test_conflicts_allow_different_resources() -> None:
    assert lost([claim("a", 0, 2), claim("b", 0, 2, what="gaze", rank=1)]) == []


def test_conflicts_keep_the_claims_of_an_earlier_block() -> None:
    held = [claim("old", 0, 2, what="gaze", block="a")]
    assert lost([claim("new", 1, 3, what="gaze")], held) == ["new"]


def test_conflicts_let_a_gaze_pass_within_its_block_but_not_contain_one() -> None:
    assert lost([claim("a", 0, 2, what="gaze"), claim("b", 1, 3, what="gaze", rank=1)]) == []
    assert lost([claim("a", 0, 2, what="gaze"), claim("b", 0, 2, what="gaze", rank=1)]) == ["b"]
    assert lost([claim("a", 0.5, 1, what="gaze"), claim("b", 0, 2, what="gaze", rank=1)]) == ["b"]


def test_conflicts_let_a_base_state_pass_to_another_block() -> None:
    held = [claim("old", 0, 0.5, what="base gaze", block="a")]
    assert lost([claim("new", 0.3, 0.8, what="base gaze")], held) == []


def test_conflicts_ignore_a_refused_claim() -> None:
    both = [claim("b", 0, 9, rank=1), claim("b", 0, 9, what="gaze", rank=1)]
    third = claim("c", 3, 4, what="gaze", rank=2)
    assert lost([claim("a", 0, 2), *both, third]) == ["b"]


def test_conflict_message_counts_from_the_start_of_the_block() -> None:
    (loss,) = conflicts([claim("n", 11, 13)], [claim("s", 10, 12, block="x")], 10.0)
    assert str(loss) == "wanted the voice from 1 to 3 s, but x:s has it from 0 to 2 s"


@given(
    st.lists(
        st.builds(
            lambda what, begin, length, rank: (what, begin, begin + length, rank),
            st.sampled_from(["voice", *PASSES]),
            st.integers(0, 10),
            st.integers(0, 5),
            st.integers(0, 3),
        ),
        max_size=12,
    )
)
def test_conflicts_leave_compatible_claims_and_name_winners(
    rows: list[tuple[str, int, int, int]],
) -> None:
    wanted = [
        ResourceClaim(what, begin, end, "b", f"c{n}", (0.0, False, rank))
        for n, (what, begin, end, rank) in enumerate(rows)
    ]
    found = conflicts(wanted, [])
    gone = {loss.claim.behaviour for loss in found}
    left = [c for c in wanted if c.behaviour not in gone]
    assert not any(a.conflicts_with(b) for a in left for b in left if a is not b)
    assert all(loss.winner in left and loss.claim.conflicts_with(loss.winner) for loss in found)


def spoken(name: str, begin: float, end: float, silent_from: float, block: str) -> ResourceClaim:
    return ResourceClaim("voice", begin, end, block, name, silent_from=silent_from)


def test_conflicts_allow_another_block_to_speak_in_a_closing_silence() -> None:
    old = spoken("old", 0, 2, 1.7, "a")
    assert lost([claim("new", 1.7, 3)], [old]) == []
    assert lost([claim("new", 1.6, 3)], [old]) == ["new"]


def test_conflicts_allow_speech_in_a_silence_of_its_block_if_asked_to() -> None:
    own = [spoken("one", 0, 2, 1.7, "b"), claim("two", 1.8, 3, rank=1)]
    assert conflicts(own, []) == []
    assert [loss.claim.behaviour for loss in conflicts(own, [], in_silence=False)] == ["two"]


def test_trims_end_a_closing_silence_where_the_new_speech_begins() -> None:
    old = [spoken("old", 0, 2, 1.7, "a"), spoken("later", 5, 6, 6, "a")]
    assert dict(trims([claim("new", 1.8, 3)], old)) == {("a", "old"): 1.8}
    assert dict(trims([claim("new", 1.8, 3, what="gaze")], old)) == {}


@pytest.mark.parametrize(
    ("winner", "loser", "sequence"),
    [
        (claim("a", 0, 2), claim("b", 1.8, 3), ("a", "b")),
        (claim("a", 1.8, 3), claim("b", 0, 2), ("b", "a")),
        (claim("a", 10, 12, block="x"), claim("b", 11.8, 13), (2.0, "b")),
        (spoken("a", 10, 12, 11.9, "x"), claim("b", 11.8, 13), (pytest.approx(1.9), "b")),
        (claim("a", 11.8, 13, block="x"), claim("b", 10, 12), ("b", pytest.approx(1.8))),
        (claim("a", 0, 2), claim("b", 1.6, 3), None),  # they overlap by more
        (claim("a", 0, 2), claim("b", 0, 0.2), None),  # one is within the other
        (claim("a", 0, 2), claim("b", 1.8, 1.9), None),
        (claim("a", 0, 2, what="gaze"), claim("b", 1.8, 3, what="gaze"), None),
    ],
)
def test_conflict_has_a_sequence_if_speeches_overlap_a_little(winner, loser, sequence) -> None:
    start = 10.0 if max(winner.end, loser.end) > 9 else 0.0
    assert ResourceConflict(loser, winner, start).sequence == sequence


def test_after_interrupts_claims_end_when_their_behaviours_do() -> None:
    held = [
        claim("s", 0, 5, block="a"),
        claim("g", 3, 5, what="gaze", block="a"),
        claim("s", 0, 5, block="b"),
    ]

    def left(**parts: tuple[str, ...]) -> list[tuple[str, str, float]]:
        act = Interrupt(id="i", target="a", **parts)
        return [(c.block, c.behaviour, c.end) for c in after_interrupts(held, [(2.0, act)])]

    assert left() == [("a", "s", 2.0), ("b", "s", 5)]
    assert left(include=("g",)) == [("a", "s", 5), ("b", "s", 5)]
    assert left(exclude=("g",)) == [("a", "s", 2.0), ("a", "g", 5), ("b", "s", 5)]


def test_interrupts_are_at_the_start_of_their_behaviours() -> None:
    bmla = 'xmlns:bmla="http://www.asap-project.org/bmla"'
    text = f'<bml id="b" {bmla}><bmla:interrupt id="i" target="a" start="2"/></bml>'
    schedule = Schedule("b", {"i": ("start", "end")}, {"i": np.array([2.0, 2.0])}, start=10.0)
    ((time, act),) = interrupts(parse(text, VOCABULARY), schedule)
    assert (time, act.target) == (12.0, "a")


times = st.integers(0, 40).map(lambda k: k / 4)
claims_of = st.builds(
    lambda resource, block, begin, length, rank: ResourceClaim(
        resource, begin, begin + length, block, f"{begin}-{length}-{rank}", (0.0, False, rank)
    ),
    st.sampled_from(["voice", "gaze", "base gaze"]),
    st.just("new"),
    times,
    times,
    st.integers(0, 10**6),
)


@pytest.mark.parametrize("many", [2, resources.MANY])
@given(st.lists(claims_of, max_size=40), st.lists(claims_of, max_size=8), st.integers(1, 2))
def test_conflicts_are_those_of_all_pairs(many, new, existing, blocks) -> None:
    new = [replace(claim, behaviour=f"n{k}", rank=(0.0, False, k)) for k, claim in enumerate(new)]
    existing = [replace(claim, block=f"old{k % blocks}") for k, claim in enumerate(existing)]
    granted, expected = list(existing), []
    for claim in new:
        winner = next((g for g in granted if g.conflicts_with(claim)), None)
        if winner is None:
            granted.append(claim)
        else:
            expected.append((claim, winner))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(resources, "MANY", many)
        found = [(conflict.claim, conflict.winner) for conflict in conflicts(new, existing)]
    assert [claim for claim, _ in found] == [claim for claim, _ in expected]
    if many == resources.MANY:
        assert found == expected
