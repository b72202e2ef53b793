"""Tests of speech with faults: what a document wants spoken is spoken, whatever else in it is wrong."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from functools import cache
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

import realizer
from bml_schema import BMLT, CORE, Block, BMLError, Speech, read
from realizer.speech.silent import SilentVoice
from tests.cases import CASES


def only(inside: str) -> Block:
    (block,) = read(f'<bml xmlns="{CORE}" id="b">{inside}</bml>')
    assert isinstance(block, Block)
    return block


def words(block: Block, id: str = "s") -> str:
    speech = block[id]
    assert isinstance(speech, Speech)
    return " ".join(str(speech.text).split())


@pytest.mark.parametrize(
    ("inside", "spoken"),
    [
        ("<speech id='s'>Hello <b>big</b> world</speech>", "Hello big world"),
        ("<speech id='s'><text>Hello</text> you <text>there</text></speech>", "Hello you there"),
        ("<speech id='s'><foo/><text>Hello</text></speech>", "Hello"),
        ("<speech id='s' start='x:end' end='1 o clock'><text>Hello</text></speech>", "Hello"),
        ("<speech id='s' foo:bar='1' start=''><text>Hello</text></speech>", "Hello"),
        ("<speech id='s'><text>Hello</text><description>x</description></speech>", "Hello"),
        ("<speech id='s'><text>He<sync id='m' ref='nobody:end'/>llo</text></speech>", "Hello"),
        ("<par><speech id='s'><text>Hello</text></speech></par>", "Hello"),
        ("<head id='h' lexeme='NOD'><speech id='s'><text>Hello</text></speech></head>", "Hello"),
        ("<constraint><speech id='s'><text>Hello</text></speech></constraint>", "Hello"),
        ("<say id='s'><text>Hello</text></say>", "Hello"),
        ("<x:speech xmlns:x='urn:x' id='s'><text>Hello</text></x:speech>", "Hello"),
        ("<required><speech id='s'>Hello <b>you</b></speech></required>", "Hello you"),
    ],
)
def test_speech_rescue_keeps_the_words_and_warns(inside: str, spoken: str) -> None:
    block = only(inside)
    assert words(block) == spoken
    assert block.problems


@pytest.mark.parametrize(
    ("speech", "id"),
    [
        ("<speech><text>Hello</text></speech>", "speech1"),
        ("<speech id='a:b'><text>Hello</text></speech>", "speech1"),
        ("<speech id=''><text>Hello</text></speech><wait id='speech1' duration='1'/>", "speech2"),
        ("<wait id='s' duration='1'/><speech id='s'><text>Hello</text></speech>", "speech1"),
    ],
)
def test_speech_without_an_id_of_its_own_gets_one(speech: str, id: str) -> None:
    block = only(speech)
    assert words(block, id) == "Hello"
    assert [p.id for p in block.problems] == [f"b:{id}"]


def test_speech_rescue_keeps_marks_for_references() -> None:
    block = only(
        "<head id='h' lexeme='NOD' stroke='s:m'/>"
        "<speech id='s'><text>a <b>b <sync id='m'/>c</b></text></speech>"
    )
    assert [b.id for b in block.behaviours] == ["h", "s"]
    assert words(block) == "a b c"


def test_required_speech_with_a_wrong_reference_takes_the_block() -> None:
    block = only("<required><speech id='s' start='x:end'><text>Hello</text></speech></required>")
    assert [p.fatal for p in block.problems] == [True]


def test_clean_speech_has_no_warning() -> None:
    assert not only("<speech id='s'><text>a <sync id='m'/>b</text></speech>").problems


# The law.


@cache
def documents() -> list[tuple[str, Counter[str]]]:
    """Return the corpus's documents with speech that play without warnings, and their words."""
    found = []
    for case in CASES:
        text = case.document.decode("utf-8", "replace")
        if text.count("<speech") != 1 or text.count("</bml>") != 1 or "required" in text:
            continue
        try:
            if etree.fromstring(text.encode()).find(f".//{{{CORE}}}text") is None:
                continue
            played = realizer.realize(text, voice=SilentVoice())
        except (BMLError, etree.XMLSyntaxError):
            continue
        if played.speech and not played.warnings:
            found.append((text, spoken(played)))
    return found


def spoken(played: realizer.Realization) -> Counter[str]:
    """Return the sounds that move the lips."""
    return Counter(sound.ipa for _, utterance in played.speech for sound in utterance.phonemes)


JUNK = ["", "x", "-1", "1e99", "nobody:end", "s:nothing", "0.1", "NaN", "file:///x", "start+"]
Damage = Callable[[etree._Element, Random], None]


def of(root: etree._Element, chance: Random, *names: str) -> etree._Element:
    return chance.choice([e for e in root.iter() if not names or etree.QName(e).localname in names])


def spoil_an_attribute(root: etree._Element, chance: Random) -> None:
    element = of(root, chance, "speech", "head", "faceLexeme", "gaze", "sync", "wait", "constraint")
    names = [*element.attrib, "start", "end", "relax", "amount", "stroke", "id"]
    element.set(chance.choice(names), chance.choice(JUNK))


def lose_an_attribute(root: etree._Element, chance: Random) -> None:
    element = of(root, chance, "speech", "head", "faceLexeme", "gaze", "sync", "wait")
    for name in [name for name in element.attrib if chance.random() < 0.5]:
        del element.attrib[name]


def wrap_a_speech(root: etree._Element, chance: Random) -> None:
    speech = of(root, chance, "speech")
    parent = speech.getparent()
    around = etree.Element(chance.choice(["foo", f"{{{CORE}}}sequence", "{urn:x}par"]), id="around")
    parent.replace(speech, around)
    around.append(speech)


def put_an_element_into_the_text(root: etree._Element, chance: Random) -> None:
    text = of(root, chance, "text")
    inside = etree.Element(chance.choice(["b", f"{{{CORE}}}emph", "{urn:x}a"]))
    inside.text, text.text = text.text, None
    text.insert(0, inside)


def put_an_element_beside_the_text(root: etree._Element, chance: Random) -> None:
    speech = of(root, chance, "speech")
    name = chance.choice([f"{{{CORE}}}foo", f"{{{CORE}}}sync", f"{{{CORE}}}description"])
    speech.insert(chance.randint(0, len(speech)), etree.Element(name))


def put_an_unknown_behaviour(root: etree._Element, chance: Random) -> None:
    root.insert(chance.randint(0, len(root)), etree.Element(f"{{{CORE}}}dance", id="dance1", start="0"))


def refer_to_a_file(root: etree._Element, chance: Random) -> None:
    description = etree.SubElement(
        of(root, chance, "speech"), f"{{{CORE}}}description", priority="9", type="audio"
    )
    etree.SubElement(description, f"{{{BMLT}}}audiofile", fileName=chance.choice(["no.wav", "../x.wav", ""]))


DAMAGES: list[Damage] = [
    spoil_an_attribute,
    lose_an_attribute,
    wrap_a_speech,
    put_an_element_into_the_text,
    put_an_element_beside_the_text,
    put_an_unknown_behaviour,
    refer_to_a_file,
]
HARMLESS: set[Damage] = {spoil_an_attribute, lose_an_attribute}  # a time may be right by chance


@given(st.integers(0, 10_000), st.lists(st.sampled_from(DAMAGES), min_size=1, max_size=4), st.randoms())
def test_words_are_spoken_whatever_is_wrong_around_them(
    number: int, damages: list[Damage], chance: Random
) -> None:
    text, said = documents()[number % len(documents())]
    root = etree.fromstring(text.encode())
    for damage in damages:
        damage(root, chance)
    damaged = etree.tostring(root, encoding="unicode")
    played = realizer.realize(damaged, voice=SilentVoice())
    heard = spoken(played)
    assert all(heard[sound] >= count for sound, count in said.items() if sound), damaged
    # A text that an SSML description replaces is not spoken.
    assert played.warnings or {*damages} <= HARMLESS or "ssml+xml" in text, damaged


def test_corpus_has_documents_for_the_law() -> None:
    assert len(documents()) > 20
