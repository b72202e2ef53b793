"""The data types of speech."""

from itertools import pairwise

from hypothesis import given
from hypothesis import strategies as st

from realizer.speech.utterance import Phoneme, tile

STARTS = st.lists(
    st.tuples(st.integers(0, 1000), st.sampled_from(["", "a", "t"]), st.integers(0, 2)), min_size=1
)


def test_tile_joins_pauses_and_scales_times() -> None:
    starts = [(0, "", 0), (100, "", 0), (200, "a", 1), (300, "t", 0), (400, "", 0)]
    assert tile(starts, 1000, 1000) == (
        Phoneme(0.0, 0.2, ""),
        Phoneme(0.2, 0.3, "a", 1),
        Phoneme(0.3, 0.4, "t"),
        Phoneme(0.4, 1.0, ""),
    )
    assert tile([], 1000) == ()
    assert tile([(0, "", 0)], 0) == ()


@given(STARTS)
def test_tile_has_no_gaps(starts: list[tuple[int, str, int]]) -> None:
    starts = [(0, "", 0), *sorted(starts, key=lambda start: start[0])]
    found = tile(starts, 1001)
    assert (found[0].start, found[-1].end) == (0, 1001)
    assert all(a.end == b.start for a, b in pairwise(found))
    assert all(p.end > p.start for p in found)
