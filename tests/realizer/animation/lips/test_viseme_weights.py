"""Weights of visemes: the spoken one is the greatest, closures are alone, and they add up to 1."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from realizer.animation.lips.viseme_weights import fap_1, oculus_visemes, oculus_weights, viseme_weights
from realizer.core.array_types import Float64
from realizer.speech.utterance import Phoneme
from realizer.tables.phonemes import phoneme_features

IPA = sorted(phoneme_features())
# An example of each viseme that Oculus names, in the order of its numbers.
OCULUS = {
    "sil": "", "PP": "p", "FF": "f", "TH": "θ", "DD": "t", "kk": "k", "CH": "tʃ", "SS": "s", "nn": "n",
    "RR": "ɹ", "aa": "ɑ", "E": "ɛ", "ih": "ɪ", "oh": "ɒ", "ou": "ʊ",
}  # fmt: skip


def say(*ipa: str, length: float = 0.14) -> tuple[Phoneme, ...]:
    """Sounds of equal length between pauses of half a second."""
    middle = [Phoneme(0.5 + k * length, 0.5 + (k + 1) * length, sound, 1) for k, sound in enumerate(ipa)]
    end = middle[-1].end
    return (Phoneme(0.0, 0.5, ""), *middle, Phoneme(end, end + 0.5, ""))


def in_the_middle(phonemes: tuple[Phoneme, ...]) -> Float64:
    """(m, 15): the weights in the middle of each sound."""
    return viseme_weights(phonemes, np.array([(p.start + p.end) / 2 for p in phonemes]))


speech = st.lists(st.tuples(st.sampled_from([*IPA, "", "oʊ"]), st.floats(0.02, 0.5)), max_size=20).map(
    lambda rows: tuple(
        Phoneme(sum(length for _, length in rows[:k]), sum(length for _, length in rows[: k + 1]), ipa)
        for k, (ipa, _) in enumerate(rows)
    )
)


@given(speech, arrays(np.float64, 20, elements=st.floats(-1, 11)))
def test_viseme_weights_add_up_to_1(phonemes: tuple[Phoneme, ...], times: Float64) -> None:
    weights = viseme_weights(phonemes, times)
    assert weights.shape == (20, 15)
    assert (weights >= 0).all()
    assert weights.sum(axis=1) == pytest.approx(1)
    outside = (times <= 0) | (times >= (phonemes[-1].end if phonemes else 0) + 0.02)
    assert (weights[outside, 0] == 1).all()


def test_viseme_weights_of_k_leave_half_to_its_neighbours() -> None:
    weights = in_the_middle(say("ɑ", "k", "ɑ"))
    assert 0.3 < weights[2, 5] < weights[2, 10] < 0.6


@pytest.mark.parametrize(("ipa", "viseme"), [("p", 1), ("b", 1), ("m", 1), ("f", 2), ("v", 2)])
def test_viseme_weights_of_closures_are_1(ipa: str, viseme: int) -> None:
    weights = in_the_middle(say("ɑ", ipa, "u", length=0.07))
    assert weights[2, viseme] == pytest.approx(1)


def test_viseme_weights_of_pauses_are_neutral() -> None:
    weights = in_the_middle(say("ɑ", "t"))
    assert weights[[0, -1], 0] == pytest.approx(1)
    silent = viseme_weights((), np.array([0.0, 1.0]))
    assert np.array_equal(silent, np.eye(15)[[0, 0]])


def test_viseme_weights_are_smooth_at_50_fps() -> None:
    phonemes = say("p", "ɑ", "m", "f", "u", "s", "t", length=0.09)
    weights = viseme_weights(phonemes, np.arange(0, phonemes[-1].end, 0.02))
    assert np.abs(np.diff(weights, axis=0)).max() < 0.9


def test_oculus_visemes_are_the_15_of_the_standard_reordered() -> None:
    assert [row.name for row in oculus_visemes()] == list(OCULUS)
    assert sorted(row.viseme for row in oculus_visemes()) == list(range(15))


@pytest.mark.parametrize(("name", "ipa"), [item for item in OCULUS.items() if item[1] not in ("", "k")])
def test_oculus_weights_show_an_example_of_each(name: str, ipa: str) -> None:
    weights = oculus_weights(in_the_middle(say("a" if ipa != "ɑ" else "t", ipa, "t")))
    assert oculus_visemes()[int(weights[2].argmax())].name == name


def test_fap_1_mixes_the_two_strongest_visemes() -> None:
    weights = np.zeros((3, 15))
    weights[0, [10, 4, 5]] = 0.6, 0.3, 0.1
    weights[1, 2] = 1.0
    weights[2, 0] = 1.0
    select1, select2, blend, _ = fap_1(weights)[0]
    assert (select1, select2) == (10, 4)
    assert blend / 63 == pytest.approx(0.6 / 0.9, abs=0.01)
    assert fap_1(weights)[1:].tolist() == [[2, 0, 63, 0], [0, 0, 63, 0]]


@given(arrays(np.float64, (5, 15), elements=st.floats(0, 1)))
def test_fap_1_is_within_the_range_of_the_standard(weights: Float64) -> None:
    out = fap_1(weights)
    assert out.shape == (5, 4)
    assert (out[:, :2] >= 0).all()
    assert (out[:, :2] <= 14).all()
    assert (out[:, 2] >= 0).all()
    assert (out[:, 2] <= 63).all()
    assert (out[:, 3] == 0).all()
