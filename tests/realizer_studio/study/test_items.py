"""Tests of `realizer_studio.study.items`."""

from __future__ import annotations

import io
from collections import Counter

import numpy as np
import pytest

import bml_schema
from realizer.behaviours.registry import VOCABULARY
from realizer_studio.study.drawing import Drawer, Variant
from realizer_studio.study.items import ANSWERS, EMOTIONS, TAG, checks, control, displacements, films, naming
from tests.studies import matches


def test_checks_demand_an_answer_that_the_key_holds() -> None:
    found = checks(matches(60), np.random.default_rng(1))
    assert len(found) == 3
    assert all(one.check in ANSWERS["visual"] and one.truth == {"check": one.check} for one in found)
    assert len(checks(matches(3), np.random.default_rng(1))) == 2


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.long
def test_naming_and_displacements_are_as_many_as_published() -> None:
    with Drawer() as draw:
        named = list(naming([Variant("ada")], draw))
        moved = list(displacements([Variant("ada")], draw))
    assert Counter(one.truth["emotion"] for one in named) == dict.fromkeys(EMOTIONS, 6)
    assert len({one.shown["face"] for one in named}) == 30  # three published profiles are as printed
    assert len(moved) == 127
    assert {one.truth["fap"] for one in moved} == set(range(3, 69))
    still = {one.truth["fap"] for one in moved if not one.truth["moves"]}
    assert len(still) < 10, "most displacements can be seen"
    assert all(set(one.shown) == {"neutral", "moved", "difference"} for one in moved)


def test_control_has_as_many_expressions_at_words() -> None:
    text = "Well, <you> & me?"
    documents = {control(text, 3, np.random.default_rng(seed)) for seed in range(9)}
    assert len(documents) == 9
    for document in documents:
        assert document.count(TAG) == 3
        block = bml_schema.parse(document, VOCABULARY)
        assert str(block.behaviours[0].text).split() == text.split()


@pytest.mark.gl
@pytest.mark.slow
@pytest.mark.long
def test_films_are_pairs_with_and_without_rules() -> None:
    av = pytest.importorskip("av")
    found = list(films([Variant("ada")], ["Why?"], "en", np.random.default_rng(1), lambda count: None))
    assert ["enriched", "plain"] in [one.truth["pair"] for one in found]
    files = [content for one in found for content in one.options.values()]
    assert len({len(content) for content in files}) == len(files)
    assert av.open(io.BytesIO(files[0])).duration > 500_000  # microseconds
    for one in found:
        assert list(one.options) == one.truth["pair"]
        assert all(content[:4] == b"\x1aE\xdf\xa3" for content in one.options.values())
        assert len(set(one.options.values())) == 2
        assert not any(word in content for content in one.options.values() for word in (b"template", b"bml"))
