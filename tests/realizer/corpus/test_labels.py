"""Tests of `realizer.corpus.labels`."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.corpus.labels import change
from realizer.corpus.recording import Annotation, CorpusError, Recording

KNOWN = Recording("one", {}, (Annotation(1, 2, "anger", "eva"),), faps=np.zeros((100, 68)))


def test_change_adds_and_removes_segments_in_order() -> None:
    added = change(KNOWN, "eva", [(3, 3.5, "grief"), (0, 0.5, "anger")])
    assert [(one.start, one.text) for one in added.labels] == [(0, "anger"), (1, "anger"), (3, "grief")]
    gone = change(added, "eva", removed=[(1.01, 1.99, "anger")])
    assert [one.start for one in gone.labels] == [0, 3]
    assert change(KNOWN, "bob", [(1, 2, "anger")]).annotators == ["bob", "eva"]
    assert len(change(KNOWN, "eva", [(1.5, 3, "anger")], [(1, 2, "anger")]).labels) == 1


@pytest.mark.parametrize(
    ("added", "removed", "said"),
    [
        ([(2.5, 2, "anger")], [], "one: a text, a start and a later end"),
        ([(float("nan"), 2, "anger")], [], "a later end"),
        ([(1, 2, " ")], [], "a text"),
        ([(3, 4.2, "anger")], [], "wanted an end up to 4 s, got 4.2"),
        ([(1.5, 3, "anger")], [], "beside that of 1 to 2, got 1.5 to 3; remove that one first"),
        ([], [(5, 6, "anger")], "to remove, got 5 to 6; there are 1 to 2"),
        ([], [(1, 2, "grief")], "there are none"),
    ],
)
def test_change_says_what_is_wrong(
    added: list[tuple[float, float, str]], removed: list[tuple[float, float, str]], said: str
) -> None:
    with pytest.raises(CorpusError, match=said):
        change(KNOWN, "eva", added, removed)
