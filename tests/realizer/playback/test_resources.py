"""Tests of exclusive resources."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from realizer.playback.resources import PASSES, ResourceClaim, conflicts


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
