"""Tests of least squares and of the imports for large blocks."""

import subprocess
import sys

import numpy as np
import pytest

from realizer.scheduling.rigid_clusters import MANY, SPARSE_FROM, least_squares


@pytest.mark.parametrize("size", [3, SPARSE_FROM, 5 * SPARSE_FROM, MANY + 500])
def test_least_squares_balances_forces_at_every_free_node(size: int) -> None:
    rng = np.random.default_rng(size)
    i = np.concatenate([np.arange(size - 1), rng.integers(0, size, size)])
    j = np.concatenate([np.arange(1, size), (i[size - 1 :] + 1 + rng.integers(0, size - 1, size)) % size])
    wanted, stiffness = rng.random(len(i)), 10 ** rng.uniform(-3, 3, len(i))
    fixed = rng.random(size) < 0.1
    fixed[0] = True
    before = rng.random(size)
    x = least_squares(i, j, wanted, stiffness, fixed, before)
    pull = stiffness * (x[j] - x[i] - wanted)
    total = np.bincount(j, pull, size) - np.bincount(i, pull, size)
    np.testing.assert_allclose(total[~fixed], 0, atol=1e-9 * stiffness.max())
    np.testing.assert_array_equal(x[fixed], before[fixed])


def test_warm_up_imports_scipy() -> None:
    script = (
        "import sys\n"
        "from realizer.scheduling import warm_up\n"
        "assert not [m for m in sys.modules if m.startswith('scipy')]\n"
        "warm_up()\n"
        "assert 'scipy.sparse.linalg' in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", script], check=True)
