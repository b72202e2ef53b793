"""The work that a document costs grows with its size, whatever it contains."""

import pytest

from realizer import schedule
from tests.worst_documents import PATTERNS, document, growth

# A document of twice the size: n log n is 2.3 times as much, and by chance more of it conflicts.
MOST_GROWTH = 3.5
MOST_CALLS = 3000  # of a behaviour, half of them to read it


@pytest.fixture(scope="module", autouse=True)
def modules_and_tables() -> None:
    """Load what the first documents load."""
    schedule(document("in a row", 99))
    schedule(document("linked", 99))


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 6))])
@pytest.mark.parametrize("pattern", PATTERNS)
def test_worst_documents_cost_in_proportion_to_their_size(pattern: str, seed: int) -> None:
    calls, times = growth(pattern, 120, seed=seed)
    assert calls <= 120 * MOST_CALLS
    assert times <= MOST_GROWTH
