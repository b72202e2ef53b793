"""Mouth shapes that are recognised in sound."""

from itertools import pairwise

import numpy as np
import pytest

from realizer.core.array_types import Int16
from realizer.speech.registry import find_voice
from realizer.speech.sound_visemes.mel_stream import BANDS, viseme_facts
from realizer.speech.sound_visemes.recogniser import (
    LOWEST,
    OFFSETS,
    WEIGHTS,
    VisemeRecogniser,
    context,
    log_probabilities,
    recognised,
    shares,
)
from realizer.speech.utterance import Phoneme, SpeechRequest, Utterance
from tests.rows import each_row

LOOK_AHEAD = 0.12  # s


@pytest.fixture(scope="module")
def spoken() -> Utterance:
    pytest.importorskip("espeakng_loader")
    voice = find_voice("espeak")
    said = voice.say(SpeechRequest("My papa moved a big map. Five foxes buy a shoe, a moon and a spoon."))
    voice.close()
    return said


def in_pieces(pcm: Int16, rate: int, cuts: list[int]) -> tuple[Phoneme, ...]:
    stream = VisemeRecogniser(rate)
    found = [phoneme for piece in np.split(pcm, cuts) for phoneme in stream.feed(piece)]
    return (*found, *stream.close())


@pytest.mark.espeak
def test_recogniser_hears_the_same_in_any_pieces(spoken: Utterance) -> None:
    assert spoken.pcm is not None
    whole = recognised(spoken.pcm, spoken.sample_rate)
    random = np.random.default_rng(0)
    for count in (1, 10, 100, 400):
        cuts = np.sort(random.integers(0, len(spoken.pcm), count)).tolist()
        assert in_pieces(spoken.pcm, spoken.sample_rate, cuts) == whole


@pytest.mark.espeak
def test_recogniser_covers_the_sound_without_gaps(spoken: Utterance) -> None:
    assert spoken.pcm is not None
    found = recognised(spoken.pcm, spoken.sample_rate)
    assert (found[0].start, found[-1].end) == (0.0, spoken.duration)
    assert all(a.end == b.start and a.ipa != b.ipa for a, b in pairwise(found))


@pytest.mark.espeak
def test_recogniser_finds_closures_of_the_lips(spoken: Utterance) -> None:
    assert spoken.pcm is not None
    closed = [p for p in recognised(spoken.pcm, spoken.sample_rate) if p.ipa == "p"]
    known = [p for p in spoken.phonemes if p.ipa[:1] in ("p", "b", "m")]
    met = [k for k in known if any(c.start < k.end and c.end > k.start for c in closed)]
    assert len(met) >= 0.8 * len(known)


@pytest.mark.espeak
def test_recogniser_is_not_late(spoken: Utterance) -> None:
    """Sound more than the look-ahead after an instant does not change what was recognised there."""
    assert spoken.pcm is not None
    rate = spoken.sample_rate
    whole = recognised(spoken.pcm, rate)
    for cut in np.arange(0.3, spoken.duration, 0.37):
        known = VisemeRecogniser(rate).feed(spoken.pcm[: round(cut * rate)])
        assert known == list(whole[: len(known)])
        assert whole[len(known)].end > cut - LOOK_AHEAD, "a phoneme that ended earlier is missing"


@each_row("rate, level", [(16_000, 0), (LOWEST - 1, 9000)])
def test_recognised_is_nothing_without_speech(rate: int, level: int) -> None:
    assert recognised(np.full(rate, level, np.int16), rate) == ()


def test_network_is_small() -> None:
    assert WEIGHTS.stat().st_size < 3e6


def test_log_probabilities_add_up_to_one_over_the_classes() -> None:
    inputs = np.random.default_rng(0).normal(size=(3, 2, len(OFFSETS) * BANDS)).astype(np.float32)
    found = log_probabilities(inputs)
    assert found.shape == (3, 2, len(viseme_facts()["class"]))
    assert np.allclose(np.exp(found).sum(axis=-1), 1, atol=1e-5)
    assert np.isclose(shares().sum(), 1, atol=0.01)


def test_log_probabilities_of_a_block_do_not_depend_on_others() -> None:
    inputs = np.random.default_rng(1).normal(size=(50, 2, len(OFFSETS) * BANDS)).astype(np.float32)
    alone = np.concatenate([log_probabilities(inputs[k : k + 1]) for k in range(50)])
    assert np.array_equal(log_probabilities(inputs), alone)


def test_context_is_the_same_at_any_level() -> None:
    log = np.random.default_rng(2).normal(-8, 2, (1, len(OFFSETS), BANDS)).astype(np.float32)
    level, mean = np.zeros(1, np.float32), np.full((1, BANDS), -5, np.float32)
    assert np.allclose(context(log, level, mean), context(log - 2, level - 2, mean), atol=1e-5)
