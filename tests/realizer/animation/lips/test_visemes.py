"""Conversion of IPA to visemes."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.animation.lips.visemes import PAUSE, lip_shapes, own_shapes, sounds
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
