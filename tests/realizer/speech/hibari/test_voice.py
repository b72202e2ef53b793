"""The neural voice: times compared with the sound, and odd texts."""

import threading
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from realizer.core.errors import VoiceError
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.hibari.voice import HibariVoice, ProsodyRun, runs
from realizer.speech.registry import find_voice
from realizer.speech.ssml import read_script
from realizer.speech.ssml_prosody import Prosody
from realizer.speech.utterance import SpeechRequest, Utterance
from realizer.tables.phonemes import phoneme_features

pytestmark = pytest.mark.xdist_group("voices")

hibari = pytest.mark.hibari

HELLO = SpeechRequest('Hello, I am <mark name="s1"/>very pleased to <mark name="s2"/>meet you.', ("s1", "s2"))


def starts(utterance: Utterance) -> dict[str, float]:
    return {word.text: word.start for word in utterance.words}


def same(a: Utterance, b: Utterance) -> bool:
    return (a.words, a.phonemes, a.marks) == (b.words, b.phonemes, b.marks) and np.array_equal(a.pcm, b.pcm)


def level(utterance: Utterance, start: float, end: float) -> float:
    """Root mean square of the sound between two times."""
    assert utterance.pcm is not None
    rate = utterance.sample_rate
    return float(np.sqrt(np.mean(utterance.pcm[round(start * rate) : round(end * rate)].astype(float) ** 2)))


def tiles(utterance: Utterance) -> bool:
    borders = [(p.start, p.end) for p in utterance.phonemes]
    return (
        borders[0][0] == 0
        and borders[-1][1] == utterance.duration
        and all(a[1] == b[0] for a, b in pairwise(borders))
        and all(end > start for start, end in borders)
    )


@hibari
@pytest.mark.slow
def test_hibari_duration_is_that_of_sound_and_phonemes(neural: HibariVoice) -> None:
    said = neural.say(HELLO)
    assert said.pcm is not None
    assert said.duration == len(said.pcm) / said.sample_rate
    assert tiles(said)
    assert [w.text for w in said.words] == ["Hello", "I", "am", "very", "pleased", "to", "meet", "you"]
    assert not said.warnings


@hibari
def test_hibari_marks_are_where_their_word_is_heard(neural: HibariVoice) -> None:
    said = neural.say(HELLO)
    assert said.marks == {"s1": starts(said)["very"], "s2": starts(said)["meet"]}
    # Against the sound: after a break of silence the marked word is the first thing that is heard.
    said = neural.say(SpeechRequest('One. <break time="700ms"/><mark name="m"/>Bob.', ("m",)))
    assert said.pcm is not None
    at = round(said.marks["m"] * said.sample_rate)
    before = np.flatnonzero(np.abs(said.pcm[:at].astype(int)) > 300)
    after = np.flatnonzero(np.abs(said.pcm[at:].astype(int)) > 300)
    assert at - before[-1] > 0.5 * said.sample_rate
    assert after[0] < 0.08 * said.sample_rate


@hibari
def test_hibari_vowels_sound_and_pauses_are_silent(neural: HibariVoice) -> None:
    said = neural.say(SpeechRequest("Yes, I know. Papa is here! Now we go."))
    pauses = [p for p in said.phonemes if not p.ipa and p.end - p.start > 0.3]
    assert len(pauses) == 3, "between the sentences, and at the end"
    assert all(level(said, p.start + 0.05, p.end - 0.1) < 20 for p in pauses)
    assert all(level(said, p.start, p.end) > 300 for p in said.phonemes if p.stress == 1)
    loud = np.flatnonzero(np.abs(np.asarray(said.pcm, int)) > 100)
    assert said.words[-1].end == pytest.approx(loud[-1] / said.sample_rate, abs=0.06)


@hibari
def test_hibari_phonemes_have_lip_shapes(neural: HibariVoice) -> None:
    text = "Judge church, boy, how are you? The thing is measured: she sings of butter, oh, air and ice; yes."
    said = neural.say(SpeechRequest(text))
    assert {"dʒ", "tʃ", "ɔɪ", "aʊ", "oʊ", "aɪ", "ð", "θ", "ʒ", "ʃ", "ŋ"} <= {p.ipa for p in said.phonemes}
    letters = {letter for p in said.phonemes for letter in p.ipa.replace("ː", "")}
    assert letters <= {letter for known in phoneme_features() for letter in known}


@hibari
@pytest.mark.parametrize(
    ("text", "word"),
    [
        ('At <mark name="m"/>7:30 pm we go.', "seven"),
        ('At 7:30 <mark name="m"/>pm we go.', "pm"),
        ('It costs $9.99 <mark name="m"/>today.', "today"),
        ('this and/<mark name="m"/>or that', "or"),
        ('He said "<mark name="m"/>stop" and left.', "stop"),
        ('in St. <mark name="m"/>Paul it is', "Paul"),
        ("on the 3rd of <bookmark mark='m'/>March 2024", "March"),
        ('First. <mark name="m"/>Second. Third.', "Second"),
    ],
)
def test_hibari_marks_are_before_words_that_are_expanded(neural: HibariVoice, text: str, word: str) -> None:
    said = neural.say(SpeechRequest(text, ("m",)))
    assert said.marks == {"m": starts(said)[word]}
    first = next(w for w in said.words if w.text == word)
    assert first.end - first.start > 0.08
    assert min(abs(p.start - first.start) for p in said.phonemes if p.ipa) < 1e-9
    assert all(a.end <= b.start + 1e-9 for a, b in zip(said.words, said.words[1:], strict=False))


@hibari
def test_hibari_numbers_last_as_long_as_all_their_words(neural: HibariVoice) -> None:
    said = neural.say(SpeechRequest("They paid 1250431 euros."))
    number = next(w for w in said.words if w.text.startswith("1"))
    inside = [p.ipa for p in said.phonemes if number.start <= p.start < number.end]
    assert number.end - number.start > 1.5
    assert len(inside) > 25


@hibari
def test_hibari_breaks_last_as_long_as_requested(neural: HibariVoice) -> None:
    text = '{}one <mark name="a"/>{}<mark name="b"/>two'
    short, long = (
        neural.say(SpeechRequest(text.format("", f'<break time="{time}ms"/>'), ("a", "b")))
        for time in (300, 1300)
    )
    assert long.duration - short.duration == pytest.approx(1.0, abs=1e-4)
    assert long.marks["a"] == long.words[0].end
    assert long.marks["b"] == long.words[1].start > long.marks["a"] + 1.3
    assert level(long, long.marks["a"] + 0.1, long.marks["a"] + 1.2) < 10
    alone = neural.say(SpeechRequest('<break time="400ms"/>'))
    assert (alone.duration, alone.words) == (0.4, ())


@hibari
def test_hibari_prosody_changes_its_words_only(neural: HibariVoice) -> None:
    plain = neural.say(SpeechRequest("one more banana here"))
    slow = neural.say(SpeechRequest('one more <prosody rate="60%">banana</prosody> here'))
    spans = [{w.text: w.end - w.start for w in said.words} for said in (plain, slow)]
    assert spans[1]["banana"] > 1.3 * spans[0]["banana"]
    assert spans[1]["one"] < 1.3 * spans[0]["one"]
    assert tiles(slow)
    soft = neural.say(SpeechRequest('<prosody volume="-12dB">one more banana here</prosody>'))
    assert soft.duration == plain.duration
    assert level(soft, 0, 9) == pytest.approx(level(plain, 0, 9) / 4, rel=0.02)
    high = neural.say(SpeechRequest('<prosody pitch="+25%">one more banana here</prosody>'))
    assert pitch(high) == pytest.approx(1.25 * pitch(plain), rel=0.08)


def pitch(said: Utterance) -> float:
    """Hz: the median over the voiced parts, by autocorrelation."""
    assert said.pcm is not None
    rate, found = said.sample_rate, []
    for first in range(0, len(said.pcm) - 1200, 600):
        part = said.pcm[first : first + 1200].astype(float)
        part -= part.mean()
        if np.sqrt(np.mean(part**2)) < 800:
            continue
        power = np.correlate(part, part, "full")[1199:] / np.arange(1200, 0, -1)
        lags = slice(rate // 450, rate // 100)
        lag = int(power[lags].argmax()) + rate // 450
        if power[lag] > 0.5 * power[0]:
            found.append(rate / lag)
    return float(np.median(found))


@hibari
def test_hibari_rate_is_limited_by_the_voice(neural: HibariVoice) -> None:
    lengths = [neural.say(replace(HELLO, rate=rate)).duration for rate in (0.1, 0.5, 1.0, 2.0, 100.0)]
    assert lengths[0] == lengths[1] > 1.5 * lengths[2]
    assert lengths[2] > 1.5 * lengths[3] == 1.5 * lengths[4]


@hibari
@pytest.mark.parametrize("ratio", [0.75, 0.97, 1.0, 1.3, 1.6])
def test_hibari_speaks_to_a_given_length(neural: HibariVoice, ratio: float) -> None:
    natural = neural.say(HELLO)
    made = speak_to_length(neural, replace(HELLO, seconds=natural.duration * ratio))
    assert made.duration == pytest.approx(natural.duration * ratio)
    assert made.marks["s2"] == starts(made)["meet"]


@hibari
@pytest.mark.slow
def test_hibari_sound_is_independent_of_earlier_requests(neural: HibariVoice) -> None:
    lone = HibariVoice()
    try:
        lone.say(SpeechRequest("Something quite different comes first."))
        assert same(lone.say(HELLO), neural.say(HELLO))
    finally:
        lone.close()


@hibari
@pytest.mark.slow
def test_hibari_serves_many_threads(neural: HibariVoice) -> None:
    texts = [SpeechRequest(f"It is line {k}. I am sure of {k}.") for k in range(3)]
    said: dict[tuple[int, int], Utterance] = {}
    lone = HibariVoice()

    def speak(thread: int) -> None:
        for k in range(3):
            said[thread, k] = lone.say(texts[(k + thread) % 3])

    threads = [threading.Thread(target=speak, args=(n,)) for n in range(3)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    lone.close()
    assert len(said) == 9
    assert all(same(said[n, k], neural.say(texts[(k + n) % 3])) for n, k in said)


@hibari
@pytest.mark.slow
def test_hibari_estimates_times_without_durations(neural: HibariVoice) -> None:
    lone = HibariVoice(options=("--durations", "/of/another/version"))
    try:
        said, exact = lone.say(HELLO), neural.say(HELLO)
    finally:
        lone.close()
    assert [w for w in said.warnings if "does not report the durations of its phonemes" in w]
    assert tiles(said)
    assert [w.text for w in said.words] == [w.text for w in exact.words]
    # Both cut the silence before the sound; the rest is the error of estimated durations.
    late = [a.start - b.start for a, b in zip(said.words, exact.words, strict=True)]
    assert max(map(abs, late)) < 0.3
    assert said.marks == {"s1": starts(said)["very"], "s2": starts(said)["meet"]}


@hibari
@pytest.mark.parametrize(
    ("text", "warning"),
    [
        ("one <b>two", "not well-formed"),
        ("one \x00\x07 two", "control characters"),
        ("one 😀 two", "emoji"),
        ("one 你好 two", "hibari cannot pronounce '你', '好'"),
        ("one Привет two", "hibari cannot pronounce 'Привет'"),
        ("one مرحبا two", "hibari cannot pronounce 'مرحبا'"),
    ],
)
def test_hibari_speaks_bad_text_with_a_warning(neural: HibariVoice, text: str, warning: str) -> None:
    said = neural.say(SpeechRequest(text))
    assert {"one", "two"} <= set(starts(said))
    assert [sentence for sentence in said.warnings if warning in sentence]
    assert len(said.warnings) == 1
    assert tiles(said)


@hibari
@pytest.mark.parametrize("text", ["", "   ", "😀", '<mark name="m"/>', "...", "\x00", "你好"])
def test_hibari_warns_of_a_text_without_words(neural: HibariVoice, text: str) -> None:
    said = neural.say(SpeechRequest(text, ("m",)))
    assert said.duration == 0
    assert said.phonemes == ()
    assert [sentence for sentence in said.warnings if "nothing" in sentence]


@hibari
def test_hibari_reads_other_languages_as_english(neural: HibariVoice) -> None:
    assert neural.say(SpeechRequest("one two", language="en_GB")).warnings == ()
    said = neural.say(SpeechRequest("een twee", language="nl-NL"))
    assert said.duration > 0.5
    assert said.warnings == ("hibari speaks English only: 'nl-NL' is read as English",)


@hibari
def test_hibari_reads_brackets_as_text(neural: HibariVoice) -> None:
    said = neural.say(SpeechRequest("one [two](/hˈi/) three"))
    assert [w.text for w in said.words] == ["one", "two", "hˈi", "three"]
    assert starts(said)["three"] > starts(said)["two"] + 0.2


@hibari
def test_hibari_speaks_a_long_text(neural: HibariVoice) -> None:
    said = neural.say(
        SpeechRequest("I am here, and it is late. " * 12 + "word " * 150 + '<mark name="end"/>', ("end",))
    )
    assert len(said.words) == 12 * 7 + 150
    assert all(a.end <= b.start for a, b in zip(said.words, said.words[1:], strict=False))
    assert said.words[-1].end == said.marks["end"] < said.duration
    assert min(w.end - w.start for w in said.words) > 0.05
    with pytest.raises(VoiceError, match="at most 20000 characters"):
        neural.say(SpeechRequest("word " * 40_000))


@hibari
def test_hibari_refuses_a_voice_without_fetching_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: object
) -> None:
    monkeypatch.setenv("HIBARI_HOME", str(tmp_path))
    with pytest.raises(VoiceError, match=r"wanted one of its voices heart, .*got 'nobody'"):
        find_voice("hibari:nobody")
    with pytest.raises(VoiceError, match="'emma' is not on this machine; `hibari --voice emma"):
        find_voice("hibari:emma")
    assert find_voice("hibari:heart").name == "hibari:heart"


def test_runs_end_at_breaks_and_where_prosody_changes() -> None:
    ssml = (
        'a <mark name="m"/>b <break time="1s"/>c <prosody rate="slow"> d</prosody> <sub alias="e f">x</sub>.'
    )
    found, marks = runs(read_script(SpeechRequest(ssml)))
    assert [(r.text.strip(), r.words, r.prosody.rate, r.pause) for r in found] == [
        ("a b", ("a", "b"), 1.0, 0.0),
        ("c", ("c",), 1.0, 1.0),
        ("d", ("d",), 0.75, 0.0),
        ("e f.", ("e", "f"), 1.0, 0.0),
    ]
    assert [(m.name, m.word, m.paused) for m in marks] == [("m", 1, False)]
    assert runs(read_script(SpeechRequest('a<break time="1s"/>')))[0][-1] == ProsodyRun(
        "", (), Prosody(), 1.0
    )


def test_runs_place_marks_before_and_after_breaks() -> None:
    ssml = 'a <mark name="m"/><break time="1s"/><mark name="n"/>b'
    _, marks = runs(read_script(SpeechRequest(ssml)))
    assert [(m.name, m.word, m.paused) for m in marks] == [("m", 1, True), ("n", 1, False)]


def test_runs_nest_prosody() -> None:
    ssml = 'a <prosody rate="fast">b <prosody volume="50">c</prosody> d</prosody> e'
    found, _ = runs(read_script(SpeechRequest(ssml)))
    assert [(r.words, r.prosody.rate, r.prosody.volume) for r in found] == [
        (("a",), 1.0, 1.0),
        (("b",), 1.4, 1.0),
        (("c",), 1.4, 0.5),
        (("d",), 1.4, 1.0),
        (("e",), 1.0, 1.0),
    ]
