"""The work that a document costs grows with its size, whatever it contains."""

import pytest

from realizer import schedule
from tests.worst_documents import PATTERNS, calls, document, growth, longest_stretch, mixed_document

# A document of twice the size: n log n is 2.3 times as much, and by chance more of it conflicts.
MOST_GROWTH = 3.5
MOST_CALLS = 3000  # of a behaviour, half of them to read it
MOST_TOGETHER = 40  # calls of a behaviour between two pauses: 30 ms for the largest documents


@pytest.fixture(scope="module", autouse=True)
def modules_and_tables() -> None:
    """Load what the first documents load."""
    schedule(document("in a row", 99))
    schedule(document("linked", 99))
    schedule(mixed_document(30, 73))  # needs the solver of large problems


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 3))])
@pytest.mark.parametrize("pattern", PATTERNS)
def test_worst_documents_cost_in_proportion_to_their_size(pattern: str, seed: int) -> None:
    calls, times = growth(pattern, 120, seed=seed)
    assert calls <= 120 * MOST_CALLS
    assert times <= MOST_GROWTH


@pytest.mark.parametrize("seeds", [range(40), pytest.param(range(40, 120), marks=pytest.mark.slow)])
def test_worst_documents_found_at_random_cost_no_more(seeds: range) -> None:
    costs = {seed: calls(lambda seed=seed: schedule(mixed_document(30, seed))) / 30 for seed in seeds}
    worst = max(costs, key=lambda seed: costs[seed])
    assert costs[worst] <= 2 * MOST_CALLS, f"seed {worst}"


@pytest.mark.parametrize("pattern", PATTERNS)
def test_worst_documents_are_paused_often(pattern: str) -> None:
    number, where = longest_stretch(document(pattern, 100))
    assert number <= 100 * MOST_TOGETHER, where
