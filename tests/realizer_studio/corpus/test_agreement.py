"""Tests of `realizer_studio.corpus.agreement`."""

import numpy as np
import pytest

from realizer_studio.corpus.agreement import agreement, alpha
from realizer_studio.corpus.recording import Annotation, Recording


def test_alpha_is_that_of_krippendorffs_example() -> None:
    """Computing Krippendorff's alpha-reliability (2011), four observers: nominal 0.743, interval 0.849."""
    nan = np.nan
    codes = np.array(
        [
            [1, 2, 3, 3, 2, 1, 4, 1, 2, nan, nan, nan],
            [1, 2, 3, 3, 2, 2, 4, 1, 2, 5, nan, 3],
            [nan, 3, 3, 3, 2, 3, 4, 2, 2, 5, 1, nan],
            [1, 2, 3, 3, 2, 4, 4, 1, 2, 5, 1, nan],
        ]
    )
    assert alpha(codes) == pytest.approx(0.743, abs=5e-4)
    assert alpha(codes, numbers=True) == pytest.approx(0.849, abs=5e-4)


def test_alpha_of_full_agreement_is_1_and_of_one_value_none() -> None:
    codes = np.array([[0, 1, 1, 0], [0, 1, 1, 0]], float)
    assert alpha(codes) == 1
    assert alpha(codes[:1]) is None
    assert alpha(np.zeros((2, 4))) is None


def test_agreement_compares_annotators_frame_by_frame() -> None:
    def labels(by: str, *spans: tuple[float, float, str]) -> tuple[Annotation, ...]:
        return tuple(Annotation(*span, by) for span in spans)

    both = labels("eva", (0, 2, "anger"), (1, 2, "grief")) + labels("otto", (0, 2, "anger"), (3, 4, "grief"))
    alone = labels("eva", (0, 4, "anger"))
    rows = dict(
        agreement([Recording("r", {"frames": 200}, both), Recording("s", {"frames": 50}, alone)]).rows
    )
    assert rows["anger"] == 1
    assert rows["grief"] < 0 < rows["all"] < 1
