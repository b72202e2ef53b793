"""Tests of the behaviours that this project adds to BML."""

import pytest

from bml_schema import OWN, Behaviour, Block, Emotion, Fap, FapFile, Faps, Idle, Mood, Timeline, parse, write

WAYS = "wanted one of a name, an angle, or valence with arousal"


def document(inside: str) -> Block:
    return parse(f"<bml id='b' xmlns:r='{OWN}'>{inside}</bml>")


def only(inside: str) -> Behaviour:
    """Return the one behaviour of a document, after writing and reading it."""
    block = document(inside)
    assert not block.problems
    assert parse(write(block)) == block
    (behaviour,) = block.behaviours
    return behaviour


def test_emotion_has_a_word_or_a_place_on_the_wheel() -> None:
    assert only("<r:emotion id='e' name='worried' intensity='1'/>") == Emotion(
        id="e", name="worried", intensity=1.0
    )
    assert only("<r:mood id='e' angle='-90' activation='4.5' profile='k1'/>") == Mood(
        id="e", angle=-90.0, activation=4.5, profile="k1"
    )
    assert only("<r:emotion id='e' angle='1000'/>") == Emotion(id="e", angle=1000.0, intensity=1.0)
    assert only("<r:mood id='e' valence='-1' arousal='.5' seed='7'/>") == Mood(
        id="e", valence=-1.0, arousal=0.5, seed=7
    )


@pytest.mark.parametrize("tag", ["emotion", "mood"])
@pytest.mark.parametrize(
    ("attributes", "said"),
    [
        ("", f"{WAYS}, got none of them"),
        ("name='joy' angle='10'", f"{WAYS}, got a name and an angle"),
        ("name='joy' valence='0' arousal='0'", f"{WAYS}, got a name and valence and arousal"),
        ("arousal='0'", f"{WAYS}, got arousal"),
        ("valence='-2' arousal='0'", "valence: wanted -1..1, got -2"),
        (
            "angle='1e3'",
            'angle: wanted degrees (a plain decimal number, no exponent, NaN or infinity), got "1e3"',
        ),
        ("name='joy' seed='-1'", "seed: wanted a whole number 0..2147483647, got -1"),
        ("name='joy' activation='2'", "activation: wanted an angle with it, got none"),
        ("angle='10' activation='40'", "activation: wanted 0..7, got 40"),
        ("name='joy' intensity='1.5'", "intensity: wanted 0..1, got 1.5"),
    ],
)
def test_emotion_refuses_wrong_attributes(tag: str, attributes: str, said: str) -> None:
    assert [p.text for p in document(f"<r:{tag} id='e' {attributes}/>").problems] == [said]


def test_faps_have_numbers_and_values_in_their_units() -> None:
    node = only(
        "<r:faps id='f' attackPeak='1'><r:fap number='3' value='-200'/><fap number='68' value='.5'/></r:faps>"
    )
    assert isinstance(node, Faps)
    assert node.values == (Fap(number=3, value=-200.0), Fap(number=68, value=0.5))


@pytest.mark.parametrize(
    ("inside", "said"),
    [
        ("", "wanted <fap>, got none"),
        ("<r:fap number='2' value='1'/>", "number: wanted a whole number 3..68, got 2"),
        ("<r:fap number='3'/>", "value: wanted -100000..100000, got none"),
        ("<r:fap number='3' value='1'>x</r:fap>", 'wanted elements, got the text "x"'),
    ],
)
def test_faps_refuse_wrong_values(inside: str, said: str) -> None:
    assert [p.text for p in document(f"<r:faps id='f'>{inside}</r:faps>").problems] == [said]


def test_extensions_have_files_and_idle_motion() -> None:
    assert only("<r:timeline id='t' fileName='a.toml'/>") == Timeline(id="t", file_name="a.toml")
    assert only("<r:fapFile id='f' fileName='a.fap'/>") == FapFile(id="f", file_name="a.fap")
    assert only("<r:idle id='i' blinks='0'/>") == Idle(id="i", blinks=0.0)


def test_extensions_outside_our_namespace_get_a_hint() -> None:
    (problem,) = document("<blink id='x'/>").problems
    assert (problem.id, problem.type) == ("b:x", "BEHAVIOR_TYPE_NOT_SUPPORTED")
    assert problem.text == f"no behaviour <blink> in BML 1.0, but one in the namespace {OWN}"
