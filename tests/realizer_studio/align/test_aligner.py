"""Alignment of recordings with their texts."""

import numpy as np
import pytest

from realizer.core.errors import RealizerError
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import MAX_TEXT, Recording, SpeechRequest
from realizer_studio.align.aligner import (
    INSTALL,
    align,
    align_recording,
    uniform_align,
)
from realizer_studio.align.alignment import AlignError, Alignment
from realizer_studio.align.sphinx import install_hint
from tests.realizer_studio.align.conftest import TEXT, WRONG

AFTER = "how quietly they came"

both = pytest.mark.parametrize(
    "aligner",
    [
        pytest.param("espeak", marks=pytest.mark.espeak),
        pytest.param(
            "pocketsphinx",
            marks=[pytest.mark.espeak, pytest.mark.skipif(bool(install_hint()), reason=str(install_hint()))],
        ),
    ],
)
TIMES = np.arange(48_000) / 16_000
TONE = 0.3 * np.sin(2 * np.pi * 300 * TIMES)
MARKED = (
    '<mark name="a"/>The tall woman <mark name="b"/>carried a basket of apples '
    '<break time="300ms"/><mark name="c"/>down the hill.<mark name="d"/>'
)


def errors(found: Alignment, onsets: np.ndarray) -> np.ndarray:
    return np.abs(np.array([word.start for word in found.words]) - onsets)


@both
@pytest.mark.slow
def test_align_finds_words_in_noise(aligner, sentence) -> None:
    found = align(sentence.pcm, sentence.rate, TEXT, aligner=aligner)
    assert [word.text for word in found.words] == [word.text for word in sentence.said.words]
    assert np.median(errors(found, sentence.onsets)) < 0.02
    assert np.percentile(errors(found, sentence.onsets), 90) < 0.06
    assert found.aligner == aligner
    assert found.confidence > 0.8
    assert found.warnings == ()


@both
def test_align_covers_the_recording_with_phonemes(aligner, sentence) -> None:
    found = align(sentence.pcm, sentence.rate, TEXT, aligner=aligner)
    assert found.phonemes[0].start == 0
    assert found.phonemes[-1].end == found.duration == len(sentence.pcm) / sentence.rate
    assert all(a.end == b.start for a, b in zip(found.phonemes, found.phonemes[1:], strict=False))
    assert not found.phonemes[0].ipa, "it begins with half a second of noise"
    tall = found.words[1]
    sounds = [p.ipa for p in found.phonemes if tall.start - 0.005 <= p.start < tall.end - 0.005]
    assert sounds[0] == "t"
    assert "l" in sounds
    assert max(p.stress for p in found.phonemes) >= 1
    assert len(found.phoneme_confidences) == len(found.phonemes)
    assert len(found.confidences) == len(found.words)


@both
def test_align_doubts_a_wrong_text(aligner, sentence) -> None:
    try:
        found = align(sentence.pcm, sentence.rate, WRONG, aligner=aligner)
    except AlignError as error:
        assert "does not find the text" in str(error)  # noqa: PT017
        return
    assert found.confidence < 0.5
    assert "does not sound like the text" in found.warnings[0]


@pytest.mark.espeak
def test_align_doubts_noise(sentence) -> None:
    noise = np.random.default_rng(1).normal(0, 0.1, 48_000)
    assert align(noise, 16_000, TEXT).confidence < 0.2


@pytest.mark.espeak
def test_align_doubts_a_text_of_another_language(sentence) -> None:
    assert (
        align(sentence.pcm, sentence.rate, "Moja siostra mieszka w małym domu nad rzeką.", "pl").confidence
        < 0.5
    )


@pytest.mark.espeak
def test_align_uses_espeak_for_other_languages(zin) -> None:
    found = align(zin.pcm, zin.rate, "Mijn zus woont in een klein huis aan het water.", "nl-NL")
    assert found.aligner == "espeak"
    assert np.median(errors(found, zin.onsets)) < 0.02
    assert found.confidence > 0.8


def test_align_spreads_words_without_an_aligner(monkeypatch) -> None:
    from realizer_studio.align import aligner, sphinx

    monkeypatch.setattr(aligner, "reference_voice", SilentVoice)
    monkeypatch.setattr(sphinx, "install_hint", lambda: "not here")
    times = np.arange(32_000) / 16_000
    tone = np.where((times > 0.5) & (times < 1.5), 0.3 * np.sin(2 * np.pi * 300 * times), 0.0)
    found = align(tone, 16_000, AFTER)
    assert (found.aligner, found.confidence) == ("even", 0.0)
    assert found.words[0].start == pytest.approx(0.5, abs=0.05)
    assert found.words[-1].end == pytest.approx(1.5, abs=0.05)
    assert "pip install" in found.warnings[0]


@pytest.mark.espeak
@pytest.mark.parametrize(
    ("pcm", "rate", "text", "says"),
    [
        (np.zeros(16_000, np.int16), 16_000, TEXT, "wanted speech, got silence"),
        ([], 16_000, TEXT, "of sound, got 0 s"),
        (np.ones(9000), 16_000, "", "text: wanted words"),
        (np.ones(9000), 16_000, " ...! ", "text: wanted words"),
        (np.ones(3200), 16_000, TEXT, "wanted about .* s for 11 words, got 0.20 s"),
        (np.ones(9000), 16_000, "x" * (MAX_TEXT + 1), f"at most {MAX_TEXT} characters"),
    ],
)
def test_align_refuses(pcm, rate, text, says) -> None:
    with pytest.raises(RealizerError, match=says):
        align(pcm, rate, text)


def test_align_refuses_an_unknown_aligner(sentence) -> None:
    with pytest.raises(AlignError, match="wanted pocketsphinx or espeak, got 'mine'"):
        align(sentence.pcm, sentence.rate, TEXT, aligner="mine")  # type: ignore[arg-type]


def test_uniform_align_skips_silence() -> None:
    loud = ((TIMES > 0.5) & (TIMES < 1.0)) | ((TIMES > 2.0) & (TIMES < 2.5))
    reference = SilentVoice().say(SpeechRequest("one two"))
    found = uniform_align(np.where(loud, TONE, 0).astype(np.float32), 3.0, reference)
    first, second = found.words
    assert (first.start, first.end) == (pytest.approx(0.5, abs=0.03), pytest.approx(1.0, abs=0.03))
    assert second.start >= first.end
    assert second.end == pytest.approx(2.5, abs=0.03)
    assert (found.aligner, found.confidence, found.confidences) == ("even", 0.0, (0.0, 0.0))
    assert found.warnings == (INSTALL,)


def test_uniform_align_keeps_the_proportions_of_the_reference() -> None:
    reference = SilentVoice().say(SpeechRequest("banana dog"))  # three vowel units, and one
    first, second = uniform_align(TONE.astype(np.float32), 3.0, reference).words
    assert first.end - first.start == pytest.approx(3 * (second.end - second.start), rel=0.1)


@pytest.mark.espeak
def test_align_recording_places_marks_before_their_words(sentence) -> None:
    recording = Recording(sentence.rate, sentence.pcm)
    said = align_recording(SpeechRequest(MARKED, ("a", "b", "c", "d")), recording)
    starts = {word.text: word.start for word in said.words}
    assert said.marks["a"] == starts["The"]
    assert said.marks["b"] == starts["carried"]
    assert said.marks["c"] == pytest.approx(starts["down"], abs=0.1)
    assert said.marks["d"] == pytest.approx(said.words[-1].end, abs=0.01)
    assert said.duration == len(sentence.pcm) / sentence.rate
    assert said.pcm is sentence.pcm
    assert said.stretch == (1, 1)


@pytest.mark.espeak
def test_recording_in_a_request_replaces_the_voice(sentence) -> None:
    request = SpeechRequest(MARKED, ("a",), seconds=1.0, recording=Recording(sentence.rate, sentence.pcm))
    said = speak_to_length(SilentVoice(), request)
    assert said.duration == len(sentence.pcm) / sentence.rate
    assert [word.text for word in said.words] == [word.text for word in sentence.said.words]
    assert speak_to_length(SilentVoice(), request) is said, "it is aligned once"


def test_align_recording_falls_back_to_the_sound() -> None:
    silence = Recording(8000, np.zeros(8000, np.int16))
    said = align_recording(SpeechRequest("Hello", recording=silence), silence)
    assert said.pcm is silence.pcm
    assert (said.duration, said.words, said.phonemes) == (1.0, (), ())
    assert "lips do not move with the recording" in said.warnings[0]
