"""Tests of Greta's FML: what is meant is shown, and what is not shown is named."""

from __future__ import annotations

import pytest

from bml_schema import OWN, Block, Emotion, FaceLexeme, Head, read
from bml_schema.dialects.intentions import fml_of, intentions
from bml_schema.dialects.table import Row
from realizer.pipeline import plan
from realizer.playback.player import Player
from realizer.speech.silent import SilentVoice
from tests.rows import each_row

SPEECH = '<bml><speech id="s1" start="0.0">Hello <tm id="tm1"/>there<tm id="tm2"/></speech></bml>'


def only(text: str) -> Block:
    (block,) = read(text)
    assert isinstance(block, Block), block
    return block


def meant(intention: str, bml: str = SPEECH) -> Block:
    return only(f"<fml-apml>{bml}<fml>{intention}</fml></fml-apml>")


def warning(block: Block) -> str:
    (problem,) = block.problems
    assert problem.type == "NOT_BML_1_0"
    return problem.text


def test_emotions_are_shown_by_their_importance() -> None:
    block = meant('<emotion id="e1" type="joy" start="s1:tm1" end="s1:tm2" importance="0.4"/>')
    emotion = block["e1"]
    assert isinstance(emotion, Emotion)
    assert (emotion.name, emotion.intensity) == ("joy", 0.4)
    assert {point: str(ref) for point, ref in emotion.syncs.items()} == {"start": "s1:tm1", "end": "s1:tm2"}
    assert '<emotion type="joy"> as emotion name=joy intensity=1' in warning(block)


def test_performatives_certainty_and_beats_are_brows_and_head() -> None:
    block = meant(
        '<performative id="p" type="approve" start="s1:tm1" end="s1:tm2"/>'
        '<certainty id="c" type="certain" importance="0.5"/><beat id="b" start="s1:tm1"/>'
    )
    kinds = [(b.id, type(b), getattr(b, "lexeme", "")) for b in block.behaviours]
    assert kinds == [
        ("s1", type(block["s1"]), ""),
        ("p", FaceLexeme, "SMILE"),
        ("p-2", Head, "NOD"),
        ("c", FaceLexeme, "LOWER_BROWS"),
        ("c-2", Head, "NOD"),
        ("b", FaceLexeme, "RAISE_BROWS"),
        ("b-2", Head, "NOD"),
    ]
    assert block["c-2"].amount == 0.25  # type: ignore[attr-defined]
    assert list(block["p-2"].syncs) == ["start"]  # a nod lasts as long as it does


@pytest.mark.parametrize(
    "text",
    [
        '<fml-apml><fml><emotion id="e" type="joy" start="0" end="2"/></fml></fml-apml>',
        '<fml><emotion id="e" type="joy" start="0" end="2"/></fml>',
        '<?xml version="1.0" encoding="ISO-8859-1"?><!DOCTYPE fml-apml SYSTEM "x.dtd" []>'
        '<fml-apml>\n<fml><emotion id="e" type="joy" start="0" end="2"/></fml></fml-apml>',
        '<fml-apml><fml><q:emotion/><emotion id="e" type="joy" start="0" end="2"/></fml></fml-apml>',
    ],
)
def test_fml_alone_is_shown(text: str) -> None:
    for form in (text, text.encode()):
        block = only(form)
        assert [b.tag for b in block.behaviours] == [f"{{{OWN}}}emotion"]


def test_fml_is_shown_before_and_after_its_bml_whatever_stands_before_them() -> None:
    fml = '<fml><emotion id="e" type="joy" start="s1:tm1" end="s1:tm2"/></fml>'
    for inside in (SPEECH + fml, fml + SPEECH):
        for prolog in ("", '<?xml version="1.0" encoding="ISO-8859-1"?>\n<!DOCTYPE fml-apml SYSTEM "x" []>'):
            block = only(f"{prolog}<fml-apml composition='append'>{inside}</fml-apml>")
            assert sorted(b.id for b in block.behaviours) == ["e", "s1"]


def test_what_is_not_shown_is_named() -> None:
    block = meant(
        '<world ref_type="person" ref_id="x"/><performative type="zork"/><emotion type="neutral"/>'
        '<emotion type="anger" regulation="inhibited"/><certainty/>'
        '<performative id="p" type="greet" start="s9:tm1" end="s1:tm2"/>'
    )
    assert [b.id for b in block.behaviours] == ["s1", "p", "p-2", "p-3"]
    without = warning(block).partition(" without ")[2]
    assert without == (
        '<world>, <performative type="zork">, <emotion type="neutral">, <emotion type="anger">, <certainty>, '
        '<performative start="s9:tm1">'
    )


def test_new_behaviours_get_ids_that_no_other_has() -> None:
    block = meant('<emotion id="s1" type="joy"/><emotion id="a b:c" type="joy"/><emotion type="joy"/>')
    assert [b.id for b in block.behaviours] == ["s1", "s1-2", "a-b-c", "emotion"]


def test_fml_of_a_text_is_read_as_far_as_it_goes() -> None:
    assert fml_of("<bml/>") is None
    assert [e.tag for e in fml_of('<fml><a/><b c="1></fml>')][:1] == ["a"]


@each_row("row", intentions())
def test_intentions_of_the_table_can_be_shown(row: Row) -> None:
    type = row.value.replace("*", "joy" if row.value == "*" else "")
    block = meant(f'<{row.element} id="x" type="{type}" start="0.5" end="2"/>')
    text = (
        f'<fml-apml>{SPEECH}<fml><{row.element} id="x" type="{type}" start="0.5" end="2"/></fml></fml-apml>'
    )
    (schedule,) = plan([text], Player(animates=False), SilentVoice())[0]
    assert not schedule.dropped, schedule.warnings
    assert len(block.behaviours) == 1 + (row.becomes != "-") * len(row.becomes.split(";"))
