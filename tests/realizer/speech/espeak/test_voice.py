"""espeak-ng, with a test for each of its known traps."""

import re
import threading
from dataclasses import replace
from pathlib import Path
from xml.sax.saxutils import escape

import numpy as np
import pytest

from realizer.core.errors import VoiceError
from realizer.speech.espeak.voice import EspeakVoice, choose_voice, foreign_script
from realizer.speech.utterance import SpeechRequest, Utterance

pytestmark = pytest.mark.espeak

HELLO = SpeechRequest('Hello, I am <mark name="s1"/>very pleased to <mark name="s2"/>meet you.', ("s1", "s2"))


def times(utterance: Utterance) -> tuple[object, ...]:
    return utterance.words, utterance.phonemes, dict(utterance.marks), utterance.duration


def starts(utterance: Utterance) -> dict[str, float]:
    return {word.text: word.start for word in utterance.words}


def same(a: Utterance, b: Utterance) -> bool:
    return times(a) == times(b) and np.array_equal(a.pcm, b.pcm)


def test_espeak_says_fast_sentences(voice: EspeakVoice) -> None:
    said = voice.say(SpeechRequest("They saw a saw in the hall of the law.", rate=450 / 175))
    assert said.phonemes[-1].end <= said.duration


def test_espeak_duration_is_that_of_the_sound(voice: EspeakVoice) -> None:
    said = voice.say(HELLO)
    assert said.pcm is not None
    assert said.duration == len(said.pcm) / said.sample_rate
    assert said.sample_rate == 22050
    assert np.abs(said.pcm.astype(int)).max() > 3000


def test_espeak_marks_are_where_their_word_is_heard(voice: EspeakVoice) -> None:
    said = voice.say(HELLO)
    assert said.marks == {"s1": starts(said)["very"], "s2": starts(said)["meet"]}
    assert said.pcm is not None
    # Against the sound itself: "meet" starts with a hum that "to" before it does not have.
    at = round(said.marks["s2"] * said.sample_rate)
    spectrum = np.abs(np.fft.rfft(said.pcm[at : at + 1024]))
    assert 2 < int(spectrum.argmax()) < 12  # 40-260 Hz: voiced from the mark on


@pytest.mark.parametrize(
    ("language", "text"),
    [
        ("en-US", "One two. {}Three four. {}Five it is. {}End of it. {}Last one."),
        ("nl-NL", "Een twee. {}Drie vier. {}Vijf zes. {}Zeven. {}Acht."),
        ("fr-FR", "Un deux. {}Trois quatre. {}Cinq six. {}Sept. {}Huit."),
        ("pl-PL", "Raz dwa. {}Trzy cztery. {}Pięć sześć. {}Siedem. {}Osiem."),
    ],
)
def test_espeak_marks_at_sentence_starts_are_at_their_words(
    voice: EspeakVoice, language: str, text: str
) -> None:
    marked = text.format(*(f'<mark name="{name}"/>' for name in "abcd"))
    said = voice.say(SpeechRequest(marked, tuple("abcd"), language))
    assert list(said.marks) == list("abcd")
    words = {word.start for word in said.words}
    assert set(said.marks.values()) <= words
    firsts = [s.split()[0].strip(".") for s in text.split("{}")[1:]]
    assert [w.text for w in said.words if w.start in set(said.marks.values())] == firsts


@pytest.mark.parametrize(
    "mark", ["<mark name='x'/>", '<bookmark mark="x"/>', '<s:mark name="x"/>', "<mark name='x'></mark>"]
)
def test_espeak_accepts_every_spelling_of_a_mark(voice: EspeakVoice, mark: str) -> None:
    said = voice.say(SpeechRequest(f"one two {mark}three", ("x",)))
    assert said.marks == {"x": starts(said)["three"]}
    assert not said.warnings


def test_espeak_marks_may_have_any_name(voice: EspeakVoice) -> None:
    name = "a&quot;b'ü"
    said = voice.say(SpeechRequest(f'one <mark name="{name}"/>two', (name,)))
    assert list(said.marks) == ["a\"b'ü"]


def test_espeak_sound_is_independent_of_earlier_requests() -> None:
    first, second = EspeakVoice(), EspeakVoice()
    try:
        second.say(SpeechRequest("Something quite different comes first.", language="nl"))
        for k in range(5):
            second.say(SpeechRequest(f"Number {k}."))
        assert same(first.say(HELLO), second.say(HELLO))
    finally:
        first.close()
        second.close()


def test_espeak_caches_requests(voice: EspeakVoice) -> None:
    lone = EspeakVoice()
    said = lone.say(HELLO)
    lone.close()
    assert lone.say(replace(HELLO)) is said
    assert lone.pid is None


def test_espeak_serves_many_threads(voice: EspeakVoice) -> None:
    lone = EspeakVoice()
    said: dict[tuple[int, int], Utterance] = {}
    texts = [SpeechRequest(f"It is line {k}, I am sure.") for k in range(8)]

    def speak(thread: int) -> None:
        for k in range(8):
            said[thread, k] = lone.say(texts[(k + thread) % 8])

    threads = [threading.Thread(target=speak, args=(n,)) for n in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    lone.close()
    assert len(said) == 32
    assert all(same(said[n, k], voice.say(texts[(k + n) % 8])) for n, k in said)


@pytest.mark.parametrize(
    ("tag", "engine"),
    [
        ("fr-FR", "roa/fr"),
        ("fr-fr", "roa/fr"),
        ("nl-NL", "gmw/nl"),
        ("nl_BE", "gmw/nl"),
        ("en-GB", "gmw/en"),
        ("en-US", "gmw/en-US"),
        ("EN-us", "gmw/en-US"),
        ("en-AU", "gmw/en"),
        ("pt-BR", "roa/pt-BR"),
        ("zh-CN", "sit/cmn"),
        ("zh", "sit/cmn"),
        ("zh-yue", "sit/yue"),
        ("nl", "gmw/nl"),
        ("en-gb", "gmw/en"),
        ("no", "gmq/nb"),
        ("es-MX", "roa/es-419"),
    ],
)
def test_choose_voice_by_language_tag(voice: EspeakVoice, tag: str, engine: str) -> None:
    assert choose_voice(voice._process.hello(), None, tag) == (engine, ())
    assert voice.say(SpeechRequest("a", language=tag)).duration > 0


@pytest.mark.parametrize(
    ("wanted", "engine"),
    [
        ("nl", "gmw/nl"),
        ("en-gb+f3", "gmw/en+f3"),
        ("+m3", "gmw/de+m3"),
        ("f2", "gmw/de+f2"),
        ("Polish", "zlw/pl"),
    ],
)
def test_choose_voice_by_name_and_variant(voice: EspeakVoice, wanted: str, engine: str) -> None:
    assert choose_voice(voice._process.hello(), wanted, "de-DE") == (engine, ())
    assert voice.say(SpeechRequest("a", voice=wanted, language="de-DE")).duration > 0


def test_espeak_warns_of_a_text_that_it_spells(voice: EspeakVoice) -> None:
    (warning,) = voice.say(SpeechRequest("Привет, как дела?")).warnings
    assert "in CYRILLIC letters, which a voice of en-us spells one by one: wanted its language" in warning
    assert not voice.say(SpeechRequest("Привет, как дела?", language="ru")).warnings
    assert not voice.say(SpeechRequest("Привет, как дела?", voice="ru")).warnings


def test_choose_voice_warns_of_unknown_names(voice: EspeakVoice) -> None:
    said = voice.say(SpeechRequest("hello", language="xx-YY", voice="nobody+nothing"))
    assert said.duration > 0.3
    assert [w.split(":")[0] for w in said.warnings] == [
        "espeak-ng has no voice 'nobody'",
        "espeak-ng has no variant 'nothing'",
        "espeak-ng does not speak 'xx-YY'",
    ]
    assert (
        "no voice 'dutchh', did you mean Dutch? the"
        in choose_voice(voice._process.hello(), "dutchh", "en")[1][0]
    )


@pytest.mark.parametrize(
    ("language", "text"),
    [
        ("en-GB", "The flower's power: an hour of fire, our tired choir, a player and a lower tower."),
        ("fr", "Le week-end, c'est le jazz et le marketing."),
        ("de", "Das Meeting über Computer und Chips."),
        ("pl", "Dżem, czekolada i dźwięk."),
        ("zh-CN", "你好，我很高兴见到你。"),
    ],
)
def test_espeak_phonemes_are_ipa(voice: EspeakVoice, language: str, text: str) -> None:
    said = voice.say(SpeechRequest(text, language=language))
    heard = "".join(phoneme.ipa for phoneme in said.phonemes)
    assert len(heard) > 10
    assert not set(heard) & set("()�\x00_ˈˌ͡"), heard
    assert all(len(phoneme.ipa.encode()) <= 8 for phoneme in said.phonemes)


def test_espeak_rate_is_limited_by_the_engine(voice: EspeakVoice) -> None:
    lengths = [voice.say(replace(HELLO, rate=rate)).duration for rate in (0.1, 0.5, 1.0, 2.0, 100.0)]
    assert lengths == sorted(lengths, reverse=True)
    assert lengths[1] > 1.5 * lengths[2] > 2 * lengths[3]


@pytest.mark.parametrize(
    ("text", "warning"),
    [
        ("one <b>two", "not well-formed"),
        ("one < two & three", "not well-formed"),
        ("one <!DOCTYPE a> two", "not well-formed"),
        ("one &nothing; two", "not well-formed"),
        ("one \x00\x07 two", "control characters"),
        ("one \ud800 two", "control characters"),
        ("one 😀 two", "emoji"),
    ],
)
def test_espeak_speaks_bad_text_with_a_warning(voice: EspeakVoice, text: str, warning: str) -> None:
    said = voice.say(SpeechRequest(text))
    assert {"one", "two"} <= set(starts(said))
    assert any(warning in sentence for sentence in said.warnings)


def test_espeak_keeps_marks_of_malformed_ssml(voice: EspeakVoice) -> None:
    said = voice.say(SpeechRequest("one <mark name='a'/>two <b>three <mark name=\"c\">four", ("a", "c")))
    assert said.marks == {"a": starts(said)["two"], "c": starts(said)["four"]}


@pytest.mark.parametrize("text", ["", "   ", "😀", '<mark name="m"/>', "...", "\x00"])
def test_espeak_warns_of_an_empty_text(voice: EspeakVoice, text: str) -> None:
    said = voice.say(SpeechRequest(text, ("m",)))
    assert said.duration == 0
    assert said.words == said.phonemes == ()
    assert all(time == 0 for time in said.marks.values())
    assert any("empty" in sentence for sentence in said.warnings)


def test_espeak_refuses_a_text_of_200_kilobytes(voice: EspeakVoice) -> None:
    with pytest.raises(VoiceError, match="at most 20000 characters, got 200000"):
        voice.say(SpeechRequest("word " * 40_000))
    assert voice.say(HELLO).duration > 2


def test_espeak_opens_no_files(voice: EspeakVoice, tmp_path: Path) -> None:
    said = voice.say(SpeechRequest(f'one <audio src="{tmp_path}/sound.wav">two</audio> three'))
    assert [w.text for w in said.words] == ["one", "two", "three"]


@pytest.mark.parametrize("language", ["ar", "hi", "zh", "ja", "ru", "el", "th", "ko", "de", "tr", "vi"])
def test_espeak_speaks_other_scripts(voice: EspeakVoice, language: str) -> None:
    texts = {
        "ar": "مرحبا بالعالم", "hi": "नमस्ते दुनिया", "zh": "你好世界", "ja": "こんにちは", "ru": "Привет, мир",
        "el": "καλημέρα κόσμε", "th": "สวัสดี", "ko": "안녕하세요", "de": "Grüß Gott",
        "tr": "günaydın", "vi": "xin chào",
    }  # fmt: skip
    said = voice.say(SpeechRequest(texts[language], language=language))
    assert said.words
    assert said.words[0].end > said.words[0].start
    assert sum(bool(p.ipa) for p in said.phonemes) > 3
    assert not said.warnings


@pytest.mark.parametrize(
    ("volume", "part"),
    [("+6dB", 2.0), ("-6dB", 0.5), ("soft", 0.5), ("50", 0.5), ("150%", 1.5), ("silent", 0.0)],
)
def test_espeak_volume_is_the_requested_one(voice: EspeakVoice, volume: str, part: float) -> None:
    text = "Hello there my friend."
    plain = voice.say(SpeechRequest(text)).pcm
    said = voice.say(SpeechRequest(f'<prosody volume="{volume}">{text}</prosody>')).pcm
    assert plain is not None
    assert said is not None
    assert np.std(said) / np.std(plain) == pytest.approx(part, rel=0.05, abs=0.01)


@pytest.mark.parametrize("semitones", [-4, -2, 2, 4])
def test_espeak_pitch_is_in_semitones(voice: EspeakVoice, semitones: int) -> None:
    text = "Hello there my friend, how are you doing."

    def pitch(ssml: str) -> float:
        """Hz: the median over voiced stretches of 50 ms, by autocorrelation."""
        pcm, heard = voice.say(SpeechRequest(ssml)).pcm, []
        assert pcm is not None
        for at in range(0, len(pcm) - 1102, 551):
            window = pcm[at : at + 1102].astype(float)
            if np.std(window) > 800:
                echo = np.correlate(window, window, "full")[1101:]
                heard.append(22050 / (55 + int(np.argmax(echo[55:441]))))
        return float(np.median(heard))

    asked = pitch(f'<prosody pitch="{semitones:+d}st">{text}</prosody>')
    assert 12 * np.log2(asked / pitch(text)) == pytest.approx(semitones, abs=1.0)


@pytest.mark.parametrize("end", ['there<mark name="m"/>.', 'there<mark name="k"/><mark name="m"/>.'])
def test_espeak_does_not_say_dot_after_a_mark(voice: EspeakVoice, end: str) -> None:
    plain, said = voice.say(SpeechRequest("Hello there.")), voice.say(SpeechRequest(f"Hello {end}"))
    assert [p.ipa for p in said.phonemes] == [p.ipa for p in plain.phonemes]
    assert said.marks["m"] == pytest.approx(plain.words[-1].end, abs=0.01)
    assert voice.say(SpeechRequest('It is 3<mark name="m"/>.5.')).words[-1].text != "3."


@pytest.mark.parametrize(
    "text",
    [
        "It is 50%.",
        'He said "hi".',
        "(yes).",
        "I love it .",
        "I love it ❤️.",
        "World War II.",
        "C#.",
        "[so].",
        "A @.",
        "‘so’.",
    ],
)
def test_espeak_says_no_sign_that_a_person_would_not(voice: EspeakVoice, text: str) -> None:
    said = "".join(phoneme.ipa for phoneme in voice.say(SpeechRequest(escape(text))).phonemes)
    assert not re.search("dɑːt|æstɚ|hæʃ|ɹoʊmən", said)


def test_espeak_warns_of_scripts_that_it_spells_only(voice: EspeakVoice) -> None:
    assert not voice.say(SpeechRequest("안녕하세요")).warnings
    assert "such as 'th'" in voice.say(SpeechRequest("สวัสดีครับ")).warnings[0]


@pytest.mark.parametrize(
    ("text", "language", "script"),
    [
        ("Hello there.", "en-US", None),
        ("你好,很高兴见到你。", "en-US", "CJK"),
        ("你好,很高兴见到你。", "cmn", None),
        ("Привет, как дела?", "en-GB", "CYRILLIC"),
        ("Привет, как дела?", "ru-RU", None),
        ("これはペンです", "cmn", "HIRAGANA"),
        ("The area is π times the square.", "en", None),
        ("Hello there.", "ru", None),
        ("12 + 3", "en", None),
        ("", "en", None),
    ],
)
def test_foreign_script_is_that_of_most_letters(text: str, language: str, script: str | None) -> None:
    assert foreign_script(text, language) == script
