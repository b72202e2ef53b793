"""Tests of the expansion of FAP 1 and 2."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.lips.visemes import mouth_faps, shape_table
from realizer.behaviours.fap_visemes import FapExpression, expand_compound, fap_expressions
from realizer.emotions.archetypes import archetypes
from realizer.tables import faps

JAW, BROW, CORNER, LIP = 2, 30, 11, 3  # columns


def clip(
    visemes: list[list[int]] | None = None,
    expressions: list[list[int]] | None = None,
    **low: list[int],
) -> FAPClip:
    """Return a clip of these frames; fap3=[...] are FAPs of its own."""
    count = len(visemes or expressions or next(iter(low.values())))
    values, mask = np.zeros((count, 68), np.int32), np.zeros(68, bool)
    mask[:2] = visemes is not None, expressions is not None
    for name, course in low.items():
        values[:, int(name[3:]) - 1], mask[int(name[3:]) - 1] = course, True
    ones = np.array(visemes or np.zeros((count, 4)), np.int32)
    twos = np.array(expressions or np.zeros((count, 6)), np.int32)
    return FAPClip("x", 25, values, mask, ones, twos)


def mouth(viseme: int) -> np.ndarray:
    out = np.zeros(68)
    for number, values in mouth_faps(shape_table()[0][[viseme]]).items():
        out[number - 1] = values[0]
    return out


def test_expand_compound_leaves_a_clip_without_fap_1_and_2() -> None:
    plain = clip(fap3=[1, 2])
    assert expand_compound(plain) is plain


@pytest.mark.parametrize("viseme", range(15))
def test_expand_compound_of_one_viseme_is_its_mouth(viseme: int) -> None:
    got = expand_compound(clip([[viseme, 0, 63, 0]]))
    np.testing.assert_allclose(got.values[0], mouth(viseme), atol=0.5)
    assert not got.mask[:2].any()
    assert got.mask[JAW] == (viseme > 0)


def test_expand_compound_mixes_two_visemes_by_the_blend() -> None:
    got = expand_compound(clip([[10, 1, 42, 0], [0, 10, 0, 0], [10, 14, 0, 0]]))
    np.testing.assert_allclose(got.values[0], mouth(10) * 2 / 3 + mouth(1) / 3, atol=0.5)
    np.testing.assert_allclose(got.values[1], mouth(10), atol=0.5)
    np.testing.assert_allclose(got.values[2], mouth(14), atol=0.5)


@pytest.mark.parametrize("row", fap_expressions())
def test_expand_compound_scales_the_profile_of_an_expression(row: FapExpression) -> None:
    got = expand_compound(clip(None, [[row.number, 63, 0, 0, 0, 0], [0, 0, row.number, 21, 0, 0]]))
    profile = archetypes("own")[row.emotion][0].frame()
    np.testing.assert_allclose(got.values[0], profile, atol=0.5)
    np.testing.assert_allclose(got.values[1], profile / 3, atol=0.5)


def test_expand_compound_numbers_the_six_expressions_as_the_standard() -> None:
    names = ["joy", "sadness", "anger", "fear", "disgust", "surprise"]
    assert [(row.number, row.emotion) for row in fap_expressions()] == list(enumerate(names, 1))


def test_expand_compound_keeps_faps_of_the_clip_also_at_0() -> None:
    got = expand_compound(clip([[10, 0, 63, 0]] * 2, [[6, 63, 0, 0, 0, 0]] * 2, fap3=[0, 77], fap31=[0, -5]))
    assert got.values[:, JAW].tolist() == [0, 77]
    assert got.values[:, BROW].tolist() == [0, -5]
    assert got.values[0, LIP] < 0, "the lips open all the same"
    assert got.values[0, BROW + 1] > 100, "and the other brow goes up"


def test_expand_compound_adds_faps_to_the_expression_with_init_face() -> None:
    alone = expand_compound(clip(None, [[6, 63, 0, 0, 0, 0]])).values[0, BROW]
    got = expand_compound(clip(None, [[6, 63, 0, 0, 1, 0]], fap31=[-5]))
    assert got.values[0, BROW] == alone - 5


def test_expand_compound_lets_a_viseme_have_the_lips_of_a_smile() -> None:
    smile = [[1, 63, 0, 0, 0, 0]]
    got, alone = expand_compound(clip([[1, 0, 63, 0]], smile)), expand_compound(clip(None, smile))
    assert alone.values[0, LIP] < -20
    np.testing.assert_allclose(got.values[0, LIP], mouth(1)[LIP], atol=0.5)
    assert 0 < got.values[0, CORNER] < alone.values[0, CORNER], "the corners keep some of it"
    assert got.values[0, 18] == alone.values[0, 18], "the lids all of it"


ODD = {
    "Greta's share of the lips": (
        clip([[500, 0, 0, 0]]),
        "FAP 1: wanted visemes 0..14, got 500: shown as none",
    ),
    "a negative viseme": (clip([[-1, 0, 63, 0]]), "FAP 1: wanted visemes 0..14, got -1"),
    "a blend too large": (clip([[1, 0, 64, 0]]), "FAP 1: wanted blends 0..63, got 64: limited to it"),
    "viseme_def": (clip([[1, 0, 63, 1]]), "FAP 1: viseme_def gives a meaning of its own"),
    "no such expression": (clip(None, [[7, 63, 0, 0, 0, 0]]), "FAP 2: wanted expressions 0..6, got 7"),
    "an intensity too large": (clip(None, [[1, 99, 0, 0, 0, 0]]), "FAP 2: wanted intensities 0..63, got 99"),
    "expression_def": (clip(None, [[1, 63, 0, 0, 0, 1]]), "FAP 2: expression_def gives a meaning of its own"),
}


@pytest.mark.parametrize(("odd", "says"), ODD.values(), ids=ODD)
def test_expand_compound_notes_what_cannot_be_shown(odd: FAPClip, says: str) -> None:
    (note,) = expand_compound(odd).notes
    assert note.startswith(says)


def test_expand_compound_leaves_a_mouth_that_the_clip_does_not_move() -> None:
    assert not expand_compound(clip([[500, 0, 0, 0]] * 2)).mask.any()


NUMBERS = st.integers(-(2**31) + 1, 2**31 - 1)


@given(arrays(np.int32, (3, 4), elements=NUMBERS), arrays(np.int32, (3, 6), elements=NUMBERS))
def test_expand_compound_stays_within_two_expressions(visemes: np.ndarray, expressions: np.ndarray) -> None:
    got = expand_compound(
        replace(clip([[0] * 4] * 3, [[0] * 6] * 3), visemes=visemes, expressions=expressions)
    )
    for row, values in zip(faps(), got.values.T, strict=True):
        assert (np.abs(values) <= 2 * max(abs(row.least), row.most)).all()
