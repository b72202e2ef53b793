"""Alignment with pocketsphinx."""

import numpy as np
import pytest

from realizer.speech.espeak.voice import EspeakVoice
from realizer.speech.utterance import SpeechRequest
from realizer_studio.align.features import mono, to_aligner
from realizer_studio.align.sphinx import align_words, install_hint, model_align, to_arpabet, to_ipa
from tests.realizer_studio.align.conftest import TEXT, WRONG, Noisy

pytestmark = [
    pytest.mark.espeak,
    pytest.mark.skipif(bool(install_hint()), reason=str(install_hint())),
]

WORDS: list[tuple[str, tuple[str, ...]]] = [(word, ()) for word in TEXT.rstrip(".").split()]


@pytest.fixture(scope="module")
def sound(sentence: Noisy) -> np.ndarray:
    return to_aligner(mono(sentence.pcm, sentence.rate), sentence.rate)


def test_align_words_finds_words_of_the_dictionary(sound: np.ndarray, sentence: Noisy) -> None:
    found = align_words(sound, WORDS)
    assert found is not None
    starts = [word.phones[0][0] for word in found if word is not None]
    assert np.median(np.abs(np.array(starts) - sentence.onsets)) < 0.02
    assert all(word.score <= 0 for word in found if word is not None)


def test_align_words_gives_the_same_times_again(sound: np.ndarray) -> None:
    first = align_words(sound, WORDS)
    align_words(np.random.default_rng(0).normal(0, 0.1, 32_000).astype(np.float32), WORDS[:2])
    assert align_words(sound, WORDS) == first


def test_align_words_speaks_other_words_by_their_phones(sound: np.ndarray) -> None:
    words = [*WORDS[:5], ("bzskt", ("B", "AE", "S", "K", "IH", "T")), *WORDS[6:]]
    found, usual = align_words(sound, words), align_words(sound, WORDS)
    assert found is not None
    assert usual is not None
    assert [name for _, _, name in found[5].phones] == ["B", "AE", "S", "K", "IH", "T"]  # type: ignore[union-attr]
    assert found[5].phones[0][0] == pytest.approx(usual[5].phones[0][0], abs=0.03)  # type: ignore[union-attr]


def test_align_words_ignores_words_that_it_cannot_speak(sound: np.ndarray) -> None:
    found = align_words(sound, [*WORDS, ("bzskt", ())])
    assert found is not None
    assert found[-1] is None
    assert found[:-1] == align_words(sound, WORDS)
    assert align_words(sound, [("bzskt", ())]) is None


def test_align_words_finds_nothing_in_a_short_sound(sound: np.ndarray) -> None:
    assert align_words(sound[:1600], WORDS) is None
    assert align_words(sound, WORDS) is not None


def test_model_align_finds_words_phonemes_and_stress(voice: EspeakVoice, sentence: Noisy) -> None:
    sound = to_aligner(mono(sentence.pcm, sentence.rate), sentence.rate)
    duration = len(sentence.pcm) / sentence.rate
    found = model_align(sound, duration, voice.say(SpeechRequest(TEXT)))
    assert found is not None
    assert np.median(np.abs([w.start for w in found.words] - sentence.onsets)) < 0.02
    tall = found.words[1]
    inside = [p for p in found.phonemes if tall.start - 0.005 <= p.start < tall.end - 0.005]
    assert [p.ipa for p in inside] == ["t", "ɔ", "l"]
    assert [p.stress for p in inside] == [0, 1, 0]
    assert found.confidence > 0.8


def test_model_align_doubts_a_wrong_text(voice: EspeakVoice, sentence: Noisy) -> None:
    sound = to_aligner(mono(sentence.pcm, sentence.rate), sentence.rate)
    found = model_align(sound, len(sentence.pcm) / sentence.rate, voice.say(SpeechRequest(WRONG)))
    assert found is None or found.confidence < 0.5


def test_model_align_speaks_unknown_words_like_the_reference(voice: EspeakVoice) -> None:
    text = "Zorblat gave 27 florbs to Quixley."
    said = voice.say(SpeechRequest(text, voice="en-us+f2"))
    assert said.pcm is not None
    sound = to_aligner(mono(said.pcm, said.sample_rate), said.sample_rate)
    found = model_align(sound, said.duration, voice.say(SpeechRequest(text)))
    assert found is not None
    assert np.median(np.abs([a.start - b.start for a, b in zip(found.words, said.words, strict=True)])) < 0.06
    assert found.confidence > 0.5


@pytest.mark.parametrize(
    ("ipa", "phones"),
    [
        (("h", "ə", "l", "oʊ"), ("HH", "AH", "L", "OW")),
        (("tʃ", "ɜː", "tʃ"), ("CH", "ER", "CH")),
        (("n", "iː", "ɹ"), ("N", "IY", "R")),
        (("ɛɹ", "aɪə"), ("EH", "R", "AY", "AH")),
        (("l̩", "ʲ", "☃"), ("L",)),
        ((), ()),
    ],
)
def test_to_arpabet_converts_the_longest_symbol_first(ipa, phones) -> None:
    assert to_arpabet(ipa) == phones


def test_to_ipa_uses_the_first_row_of_a_phone() -> None:
    assert [to_ipa(phone) for phone in ("HH", "AA", "ER", "JH", "SIL")] == ["h", "ɑ", "ɝ", "dʒ", ""]
    assert to_arpabet([to_ipa("NG"), to_ipa("OY")]) == ("NG", "OY")
