"""Tests of what each voice does with SSML."""

import re
from pathlib import Path

import pytest

from realizer.speech.engine_voice import EngineVoice
from realizer.speech.registry import VOICES, find_voice
from realizer.speech.ssml import SPOKEN, Break, Tag, read_script
from realizer.speech.ssml_support import supported
from realizer.speech.utterance import SpeechRequest
from tests.rows import each_row

DOCS = Path(__file__).parents[3] / "docs" / "speech.md"
ALL = frozenset(
    [
        "p",
        "s",
        "break",
        "emphasis",
        "prosody",
        "say-as",
        "sub",
        "phoneme",
        "lang",
        "voice",
        "mark",
        "audio",
        "w",
    ]
)
LOUD = (("rate", "80%"), ("volume", "+3dB"))


@each_row(
    "ssml, elements, parts",
    [
        ("<p>a</p>b", {"p"}, (Tag("p", ()), "a", Tag("p", None), "b")),
        ("<p>a</p>b", set(), ("a.", Break(0.4), "b")),
        ("<p><s>a?</s></p>b", set(), ("a?", Break(0.4), "b")),
        ("<s>a</s><s> </s>b", set(), ("a. b",)),
        ('<emphasis level="strong">a</emphasis>', set(), (Tag("prosody", LOUD), "a", Tag("prosody", None))),
        ('<say-as interpret-as="characters">ab</say-as>c', set(), ("A Bc",)),
        ('<lang xml:lang="de">a</lang>', set(), ("a",)),
    ],
)
def test_supported_replaces_elements(ssml: str, elements: set[str], parts: tuple[object, ...]) -> None:
    found = supported(read_script(SpeechRequest(ssml)), frozenset(elements | {"prosody"}), "it").parts
    assert tuple(p.strip() if isinstance(p, str) else p for p in found if p != " ") == tuple(
        p.strip() if isinstance(p, str) else p for p in parts
    )


def test_supported_warns_once_of_each_kind() -> None:
    ssml = "<lang>a</lang><lang>b</lang><voice>c</voice><p>d</p>"
    script = supported(read_script(SpeechRequest(ssml)), frozenset(), "it")
    assert script.warnings == (
        "it does not support <lang>: its text is spoken as usual",
        "it does not support <voice>: its text is spoken as usual",
    )


def documented() -> dict[str, dict[str, str]]:
    """Return element -> voice -> cell of the table in the documentation."""
    rows = re.findall(
        r"^\|(.*)\|$", DOCS.read_text("utf-8").partition("## SSML")[2].partition("\n## ")[0], re.M
    )
    head, _, *cells = [[cell.strip() for cell in row.split("|")] for row in rows]
    return {
        element: dict(zip(head[1:], row[1:], strict=True))
        for row in cells
        for element in re.findall(r"`([\w-]+)`", row[0])
    }


def test_the_table_of_the_documentation_has_every_element() -> None:
    assert documented().keys() == ALL
    assert SPOKEN.keys() <= ALL


@pytest.mark.parametrize("name", ["espeak", "hibari", "silent"])
def test_a_voice_does_what_the_table_says_and_speaks_every_word(name: str) -> None:
    if VOICES[name].missing() is not None:
        pytest.skip(f"{name} is not installed")
    voice = find_voice(name)
    plain = [w.text for w in voice.say(SpeechRequest("One two three.")).words]
    for element, cells in documented().items():
        inside = "two" if element not in ("break", "mark") else ""
        attributes = {
            "sub": 'alias="two"',
            "mark": 'name="m"',
            "say-as": 'interpret-as="cardinal"',
            "lang": 'xml:lang="en-GB"',
        }.get(element, "")
        rest = "" if inside else "two "
        ssml = f"One <{element} {attributes}>{inside}</{element}> {rest}three."
        said = voice.say(SpeechRequest(ssml, ("m",) if element == "mark" else ()))
        assert [w.text for w in said.words] == plain, element
        assert bool(said.warnings) == cells[name].startswith("no"), (element, said.warnings)
    if isinstance(voice, EngineVoice):
        voice.close()
