"""The parser of SSML."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.core.errors import VoiceError
from realizer.speech.espeak.document import write_document
from realizer.speech.ssml import MAX_TEXT, Break, Mark, Tag, read_script
from realizer.speech.utterance import SpeechRequest
from tests.rows import each_row


def parts(ssml: str) -> tuple[object, ...]:
    return read_script(SpeechRequest(ssml)).parts


def test_read_script_collapses_blanks_and_keeps_marks() -> None:
    assert parts(' a\n\t <mark name="m"/> b  &amp; c ') == ("a ", Mark("m"), "b & c ")


def test_read_script_ignores_speak_elements() -> None:
    assert parts("<speak>a <mark name='m'/>b</speak>") == ("a ", Mark("m"), "b")


def test_read_script_limits_breaks() -> None:
    ssml = '<break time="250ms"/><break time="1.5s"/><break strength="none"/><break/><break time="9999s"/>'
    assert parts(ssml) == (Break(0.25), Break(1.5), Break(0.0), Break(0.4), Break(10.0))


def test_read_script_keeps_elements_of_speech_only() -> None:
    script = read_script(
        SpeechRequest('<prosody rate="fast" onclick="x">a</prosody><audio src="/etc/passwd">b</audio>')
    )
    assert script.parts[:3] == (Tag("prosody", (("rate", "fast"),)), "a", Tag("prosody", None))
    assert script.text == "a b "
    assert "passwd" not in write_document(script).text


@each_row(
    "ssml, text, warnings",
    [
        ("<p>a</p><p>b</p>", "a b ", 0),
        ("<sentence>a</sentence><paragraph>b</paragraph>", "a b ", 0),
        ("a<audio><desc>bell</desc>b</audio>", "a b ", 0),
        ("<metadata><x>a</x></metadata>b", "b", 1),
        ('<say-as interpret-as="digits">12 ab</say-as>', "1 2 a b", 0),
        ('<say-as interpret-as="telephone">+49 30</say-as>', "+4 9 3 0", 0),
        ('<say-as interpret-as="cardinal">12</say-as>', "12", 0),
        ('<say-as interpret-as="poem">12</say-as><say-as>3</say-as>', "123", 2),
        ('<emphasis level="mega">a</emphasis>', "a", 1),
        ("<emphasys>a</emphasys>", "a", 1),
        ("<w><token>a</token></w>", "a", 0),
    ],
)
def test_read_script_speaks_the_words_of_every_element(ssml: str, text: str, warnings: int) -> None:
    script = read_script(SpeechRequest(ssml))
    assert (script.text, len(script.warnings)) == (text, warnings)


def test_read_script_suggests_an_element() -> None:
    (warning,) = read_script(SpeechRequest("<emphasys>a</emphasys>")).warnings
    assert 'did you mean "emphasis"?' in warning


def test_read_script_reads_bml_syncs_as_marks() -> None:
    assert read_script(SpeechRequest('a <bml:sync id="x"/>b')).marks == ("x",)


@pytest.mark.parametrize("mark", ["<mark/>", '<mark name=""/>', "<sync/>"])
def test_read_script_warns_of_a_mark_without_a_name(mark: str) -> None:
    script = read_script(SpeechRequest(f"one {mark}two"))
    assert (script.marks, script.warnings) == ((), ("a mark without a name is ignored",))


@pytest.mark.parametrize("tag", ["<sub>", '<sub alias="">', '<sub alias=" ">'])
def test_read_script_speaks_the_text_of_sub_without_an_alias(tag: str) -> None:
    script = read_script(SpeechRequest(f'one {tag}two <sub alias="x">y</sub></sub> 3'))
    alias = Tag("sub", (("alias", "x"),))
    assert script.parts == ("one two ", alias, "y", Tag("sub", None), " 3")
    assert script.warnings == ("<sub> has no alias: its text is spoken",)


def test_read_script_limits_the_length() -> None:
    assert read_script(SpeechRequest("a" * MAX_TEXT)).text
    with pytest.raises(VoiceError, match="split it"):
        read_script(SpeechRequest("a" * (MAX_TEXT + 1)))


@given(st.text(max_size=200))
def test_read_script_reads_any_text(text: str) -> None:
    script = read_script(SpeechRequest(text))
    document = write_document(script)
    document.text.encode()
    assert read_script(SpeechRequest(document.text[7:-8])).text == script.text


@given(
    st.lists(
        st.sampled_from(["one", "two.", " ", '<mark name="m"/>', "<p>", "</p>", "&amp;", "<", "'", "😀"])
    )
)
def test_read_script_keeps_words_of_malformed_markup(pieces: list[str]) -> None:
    script = read_script(SpeechRequest("".join(pieces)))
    assert script.text.count("one") == pieces.count("one")
    # A name is that of one place: the first.
    assert script.marks == ("m",) * ('<mark name="m"/>' in pieces)


@each_row(
    "ssml, text",
    [
        ("It costs $5.", "It costs five dollars."),
        ('Ja, <lang xml:lang="de">5 €</lang> and 5%.', "Ja, fünf Euro and five percent."),
        ('World War <mark name="m"/>II', "World War two"),
        ('<sub alias="$5">$6</sub> <say-as interpret-as="characters">5%</say-as>', "$6 5%"),
        ("I love it ❤️.", "I love it."),
    ],
)
def test_numbers_are_words_of_the_nearest_language(ssml: str, text: str) -> None:
    assert read_script(SpeechRequest(ssml, ("m",), language="en-GB")).text == text
