"""Conversion of IPA to visemes."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer import tables
from realizer.animation.lips.visemes import (
    PAUSE,
    ROLL,
    SHAPE_COLUMNS,
    lip_shapes,
    mouth_faps,
    own_shapes,
    shape_table,
    sounds,
)
from realizer.tables.phonemes import phoneme_features


def test_sounds_of_every_symbol_have_a_viseme_or_an_exception() -> None:
    for ipa, features in phoneme_features().items():
        (sound,) = sounds(ipa)
        parts = sum(part for _, part in sound.mix)
        quiet = features.place in ("glottal", "pharyngeal", "epiglottal")
        assert parts == pytest.approx(0 if quiet else 1)
        assert all(0 < viseme <= 14 for viseme, _ in sound.mix)


def test_sounds_use_all_visemes() -> None:
    used = {viseme for ipa in phoneme_features() for viseme, _ in sounds(ipa)[0].mix}
    assert used == set(range(1, 15))
    assert [row.viseme for row in lip_shapes()][:15] == list(range(15))


@pytest.mark.parametrize(
    ("phonemes", "viseme"),
    [("p b m", 1), ("f v", 2), ("θ ð", 3), ("t d", 4), ("k g", 5), ("tʃ dʒ ʃ", 6),
     ("s z", 7), ("n l", 8), ("ɹ", 9),
     ("ɑː", 10), ("ɛ", 11), ("ɪ", 12), ("ɒ", 13), ("ʊ", 14)],
)  # fmt: skip
def test_sounds_of_examples_have_the_viseme_of_the_standard(phonemes: str, viseme: int) -> None:
    for ipa in phonemes.split():
        mix = dict(sounds(ipa)[0].mix)
        assert max(mix, key=lambda v: mix[v]) == viseme


@pytest.mark.parametrize(
    ("written", "plain"),
    [
        ("t͡ʃ", "tʃ"),
        ("t̪", "t"),
        ("õ", "o"),
        ("aː", "a"),
        ("n̩", "n"),
        ("pʰ", "p"),
        ("tʲ", "t"),
        ("˥a", "a"),
        ("ç", "ç"),
        ("ɔ˞", "ɔ"),
    ],
)
def test_sounds_ignore_diacritics(written: str, plain: str) -> None:
    assert sounds(written) == sounds(plain)


def test_sounds_of_a_string_share_its_time() -> None:
    assert [s.share for s in sounds("oʊ")] == pytest.approx([0.55, 0.45])
    assert [s.vowel for s in sounds("ɔːɹ")] == [True, False]
    assert sum(s.share for s in sounds("aɪəɹ")) == pytest.approx(1)
    assert len(sounds("tʃ")) == 1
    assert sounds("kʷ")[0].mix != sounds("k")[0].mix


def test_sounds_with_targets_of_their_own_keep_their_viseme() -> None:
    shapes = lip_shapes()
    for ipa, number in own_shapes().items():
        if ipa != PAUSE:
            (sound,) = sounds(ipa)
            assert sound.shape == ((number, 1.0),)
            assert shapes[number].viseme == max(sound.mix, key=lambda pair: pair[1])[0]
    assert sounds("k")[0].shape == sounds("k")[0].mix


@given(st.text(max_size=8))
def test_sounds_accept_any_string(text: str) -> None:
    found = sounds(text)
    assert not found or sum(s.share for s in found) == pytest.approx(1)


def shape(**parts: float) -> np.ndarray:
    return np.array([[parts.get(name, 0.0) for name in SHAPE_COLUMNS]])


def test_mouth_faps_of_an_open_mouth_are_negative_in_both_lips() -> None:
    got = mouth_faps(shape(jaw=300, upper=100, lower=200))
    assert (got[3][0], got[4][0], got[5][0]) == (300, -100, -200)
    assert all(got[fap][0] < 0 for fap in (8, 9, 10, 11, 51, 52, 55, 56, 57, 58))


def test_mouth_faps_never_raise_the_jaw() -> None:
    assert mouth_faps(shape(jaw=-50))[3][0] == 0


def test_mouth_faps_move_both_sides_and_contours() -> None:
    got = mouth_faps(shape(width=-40, corner=8))
    assert {got[fap][0] for fap in (6, 7, 53, 54)} == {-40}
    assert {got[fap][0] for fap in (12, 13, 59, 60)} == {8}


def test_mouth_faps_push_the_lips_and_move_the_tongue() -> None:
    got = mouth_faps(shape(push_lower=1, push_upper=2, tip=3, thrust=4, body=5, roll=6))
    wanted = {16: 1, 17: 2, 44: 3, 45: 4, 46: 5, 47: 6 * ROLL}
    assert {fap: values[0] for fap, values in got.items() if values[0]} == wanted


def test_mouth_faps_of_pressed_lips_are_thin_and_roll_in() -> None:
    got = mouth_faps(shape(upper=-16, lower=-20))
    assert got[51][0] > got[4][0]
    assert got[52][0] > got[5][0]
    assert got[16][0] < 0
    assert got[17][0] < 0


@pytest.mark.parametrize("viseme", range(15))
def test_mouth_faps_of_every_viseme_are_within_their_range(viseme: int) -> None:
    for fap, values in mouth_faps(shape_table()[0][[viseme]]).items():
        row = tables.faps()[fap - 1]
        assert row.least <= values[0] <= row.most
