"""Tests of documents that play a FAP clip."""

from __future__ import annotations

import re

import numpy as np
import pytest

from realizer.animation.fap.fap_clip import FAPClip
from realizer.behaviours.fap_document import document_of
from realizer.core.errors import RealizerError
from realizer.offline import realize


def clip(values: np.ndarray, *used: int, fps: float = 25) -> FAPClip:
    count = len(values)
    all_values = np.zeros((count, 68), np.int32)
    all_values[:, [fap - 1 for fap in used]] = values
    mask = np.isin(np.arange(1, 69), used)
    return FAPClip("x", fps, all_values, mask, np.zeros((count, 4), np.int32), np.zeros((count, 6), np.int32))


@pytest.mark.parametrize("fps", [2, 12.5, 25, 30, 29.97])
def test_document_of_a_clip_plays_it_at_its_rate(fps: float) -> None:
    course = np.round(300 * np.sin(np.linspace(0, np.pi, 31)))
    played = realize(document_of(clip(course[:, None], 3, fps=fps), "b"), fps=fps, idle=False)
    assert played.warnings == ()
    assert played.schedules[0].at("fap", "end") == pytest.approx(30 / fps, abs=1e-3)
    np.testing.assert_allclose(played.faps.values[:31, 2], course, atol=2)


def test_document_of_a_clip_holds_its_faps_of_0() -> None:
    document = document_of(clip(np.zeros((50, 1)), 12), "b")
    smile = '<bml id="s"><faceLexeme id="l" lexeme="SMILE" start="0" end="1.9"/></bml>'
    played = realize([smile, document], idle=False)
    assert played.faps.values[25, 11] == 0
    assert played.faps.values[25, 12] > 20


def test_document_of_a_clip_limits_values_without_a_warning() -> None:
    played = realize(document_of(clip(np.full((50, 1), 99_999), 3), "b"), idle=False)
    assert played.warnings == ()
    assert played.faps.values[25, 2] == 4320


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (clip(np.zeros((1, 1)), 3), "wanted at least two frames of a FAP from 3 on, got 1 frames of 1 FAPs"),
        (clip(np.zeros((5, 0))), "got 5 frames of 0 FAPs"),
    ],
)
def test_document_of_an_empty_clip_is_refused(given: FAPClip, says: str) -> None:
    with pytest.raises(RealizerError, match=re.escape(says)):
        document_of(given, "b")
