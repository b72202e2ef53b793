"""Tests of documents in dialects, and of each row of the table."""

import re
from itertools import islice
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from lxml import etree

from bml_schema import CORE, Block, BMLError, Gaze, Head, made_ids, parse, read, write
from bml_schema.dialects.recognition import is_draft
from bml_schema.dialects.table import Row, table
from bml_schema.dialects.translator import translate, translate_elements
from bml_schema.node_schema import local
from bml_schema.vocabulary import VOCABULARY
from realizer.core.options import PlayOptions
from realizer.pipeline import plan
from realizer.playback.player import Player
from realizer.speech.silent import SilentVoice
from tests.dialects import WRAPPERS, sample
from tests.example_counts import examples
from tests.rows import each_row

DOCUMENTS = Path(__file__).parents[2] / "dialect_documents"
ROWS = [row for row in table().rows if row.element not in WRAPPERS]
# What mutations put into documents.
PIECES = (
    "",
    " ",
    '"',
    "x:",
    'type="NOD" ',
    'amount="-1e9" ',
    "<tm id='t'/>",
    "<head type='TOSS'/>",
    "s1:stroke_start",
    "{id}",
)


@each_row("row", ROWS)
def test_translate_uses_each_row_and_drops_nothing(row: Row) -> None:
    document = sample(row)
    (block,) = read(document)
    assert isinstance(block, Block), document
    assert [p.type for p in block.problems] == ["NOT_BML_1_0"], [p.text for p in block.problems]
    plain: etree._Element = etree.fromstring(document)[0]
    assert row in applied(plain), document
    assert parse(write(block)) == block


def applied(root: etree._Element) -> list[Row]:
    from bml_schema.dialects.translator import _Translation

    translation = _Translation(root)
    translation.in_dialect = True
    translation.run()
    return list(translation.applied)


def documents(dialect: str) -> list[str]:
    text = (DOCUMENTS / f"{dialect}.txt").read_text("utf-8")
    return [part for part in re.split(r"\n\s*\n", text) if part.startswith("<")]


@pytest.mark.parametrize("dialect", ["smartbody", "greta", "draft"])
def test_translate_lets_most_documents_play_without_a_loss(dialect: str) -> None:
    """85 % of documents play without dropping a behaviour that a face can show."""
    whole, found = 0, documents(dialect)
    assert len(found) >= 40
    for document in found:
        schedules, refused = plan([document], Player(PlayOptions(idle=False)), SilentVoice())
        whole += not refused and not any(schedule.dropped for schedule in schedules)
    assert whole >= 0.93 * len(found), f"{whole} of {len(found)}"


@pytest.mark.parametrize("dialect", ["smartbody", "greta", "draft"])
def test_translate_is_off_in_strict_bml(dialect: str) -> None:
    for document in documents(dialect):
        for block in read(document, strict_bml=True):
            if isinstance(block, Block):
                notes = [p.text for p in block.problems if p.type == "NOT_BML_1_0"]
                assert all(note.endswith("which is not read in strict BML") for note in notes)
                assert len(notes) <= 1


def test_translate_leaves_bml_1_0_alone() -> None:
    text = f'<bml xmlns="{CORE}" id="b"><head id="h" lexeme="NOD" start="1"/></bml>'
    root = etree.fromstring(text)
    before = etree.tostring(root)
    assert not is_draft(root)
    assert not translate(root, "", made_ids())
    assert etree.tostring(root) == before
    assert parse(f"<act>{text}</act>".replace("<act>", "").replace("</act>", "")).problems == ()


def test_translate_leaves_an_act_with_bml_1_0_alone() -> None:
    (block,) = read(f'<act><bml xmlns="{CORE}" id="b"><head id="h" lexeme="NOD"/></bml></act>')
    assert isinstance(block, Block)
    assert not block.problems


@pytest.mark.parametrize(
    "body",
    [
        '<head id="h" lexeme="NOD" amount="7"/>',
        '<head lexeme="NOD"/>',
        '<head id="h"/>',
        '<gaze id="h"/>',
        '<gazeShift id="h" target="x" ready="s:nothing"/>',
        '<head id="h" lexeme="NOD" start="w:stroke"/><wait id="w"/>',
    ],
)
def test_translate_does_not_repair_faults_of_plain_bml(body: str) -> None:
    for space in ("", f'xmlns="{CORE}" '):
        block = parse(f'<bml {space}id="b">{body}</bml>')
        assert block.problems
        assert all(p.type != "NOT_BML_1_0" for p in block.problems)


@pytest.mark.parametrize(
    "text",
    [
        '<fml-apml><bml><head id="h" lexeme="NOD"/></bml></fml-apml>',
        '<!DOCTYPE fml-apml SYSTEM "x.dtd" []><fml-apml><bml><head id="h" lexeme="NOD"/></bml></fml-apml>',
        '<fml-apml><fml><emotion type="joy"/></fml><bml><head id="h" lexeme="NOD" q:x="1"/></bml></fml-apml>',
        '<act><bml><head id="h" type="NOD"/></bml></act>',
        '<bml xmlns="http://www.mindmakers.org/projects/BML"><head id="h" lexeme="NOD"/></bml>',
        '<bml><head id="h" type="NOD"/></bml>',
    ],
)
def test_translate_gives_an_id_to_a_block_in_a_dialect(text: str) -> None:
    block = parse(text)
    assert block.id == "unnamed1"
    assert block["h"] == Head(id="h", lexeme="NOD")
    with pytest.raises(BMLError):
        parse(text, strict_bml=True)


def test_translate_gives_each_document_of_a_session_an_id_of_its_own() -> None:
    ids = made_ids()
    one = '<act><bml><head type="NOD"/></bml></act>'
    found = [*read(f"{one}{one}", block_ids=ids), *read(one, block_ids=ids)]
    assert [b.id for b in found if isinstance(b, Block)] == ["unnamed1", "unnamed2", "unnamed3"]
    assert list(islice(made_ids(), 2)) == ["unnamed1", "unnamed2"]


def test_translate_gives_ids_to_behaviours_that_no_other_has() -> None:
    block = parse(
        '<bml id="b"><head type="NOD"/><head id="head1" type="SHAKE"/><head id="head1" type="TILT"/></bml>'
    )
    assert [(n.id, getattr(n, "lexeme", "")) for n in block.behaviours] == [
        ("head2", "NOD"),
        ("head1", "SHAKE"),
        ("head3", "TILT"),
    ]


def test_translate_takes_the_character_of_a_participant() -> None:
    (block,) = read('<act><participant id="brad" role="actor"/><bml><head type="NOD"/></bml></act>')
    assert isinstance(block, Block)
    assert block.character_id == "brad"


def test_translate_takes_the_composition_of_the_element_around_a_document() -> None:
    around = '<fml-apml composition="replace" reaction_type="HALT">{}<fml/></fml-apml>'
    (block,) = read(around.format('<bml><head id="h" lexeme="Nod_Big"/></bml>'))
    (own,) = read(around.format('<bml composition="append"><head id="h" lexeme="Nod_Big"/></bml>'))
    assert isinstance(block, Block)
    assert isinstance(own, Block)
    assert (block.composition, own.composition) == ("REPLACE", "APPEND")


def test_translate_keeps_a_gaze_with_joints() -> None:
    (block,) = read('<act><bml><gaze target="camera"><sbm:chest/><sbm:head pitch="-10"/></gaze></bml></act>')
    assert isinstance(block, Block)
    assert block["gaze1"] == Gaze(id="gaze1", target="camera")
    assert [p.type for p in block.problems] == ["NOT_BML_1_0"]


def test_translate_reads_a_dialect_in_the_namespace_of_bml() -> None:
    block = parse(f'<bml xmlns="{CORE}" id="b"><gaze id="g" target="x" angle="20" direction="LEFT"/></bml>')
    assert block["g"] == Gaze(id="g", target="x", offset_angle=20.0, offset_direction="LEFT")
    assert len(block.problems) == 1


def test_translate_keeps_a_document_of_bml_1_0_what_it_is() -> None:
    block = parse(
        f'<bml xmlns="{CORE}" id="b"><head id="h" type="NOD"/>'
        '<gaze id="g" target="x" offsetDirection="UP_LEFT"/><emit id="e"/>'
        '<event id="v" message="x"/><head id="n" lexeme="Neutral"/><head lexeme="NOD"/></bml>'
    )
    assert [b.id for b in block.behaviours] == ["h", "n"]
    assert {(p.id, p.type) for p in block.problems} == {
        ("b:h", "NOT_BML_1_0"),
        ("b:g", "PARSING_FAILURE"),
        ("b:e", "BEHAVIOR_TYPE_NOT_SUPPORTED"),
        ("b:v", "BEHAVIOR_TYPE_NOT_SUPPORTED"),
        ("b:/bml/head[3]", "PARSING_FAILURE"),
    }
    assert len(block.problems) == 5
    assert not next(p for p in block.problems if p.id == "b:h").dropped


def test_translate_elements_names_what_each_element_was_read_as() -> None:
    root = etree.fromstring(
        f'<bml xmlns="{CORE}" id="b" character="x"><head id="h" type="NOD"/><wait id="w"/></bml>'
    )
    read_as = translate_elements(root)
    assert {e.get("id"): text for e, text in read_as.items()} == {
        "b": "read as Greta's BML: <bml character> as characterId",
        "h": 'read as SmartBody\'s BML: <head type="NOD"> as lexeme=NOD',
    }


def test_translate_keeps_the_lines_of_elements() -> None:
    block = parse('<bml id="b">\n<face id="f"\n type="facs"\n au="1"/>\n<head id="h"\n type="NOD"/></bml>')
    assert [place.line for place in block.places.values()] == [2, 5]


def test_translate_knows_every_behaviour_of_the_table() -> None:
    assert {"head", "gaze", "face", "speech"} <= {local(tag) for tag in VOCABULARY}


@examples(2)
@given(st.data())
def test_translate_of_mutated_documents_gives_blocks_that_can_be_written(data: st.DataObject) -> None:
    text = data.draw(
        st.sampled_from([d for name in ("smartbody", "greta", "draft") for d in documents(name)])
    )
    for _ in range(data.draw(st.integers(1, 3))):
        first = data.draw(st.integers(0, len(text)))
        last = data.draw(st.integers(first, min(len(text), first + 30)))
        piece = data.draw(st.sampled_from(PIECES))
        text = text[:first] + piece + text[last:]
    for found in read(text):
        assert isinstance(found, Block | BMLError)
        if isinstance(found, Block):
            assert parse(write(found)) == found


def test_translate_takes_linear_time_for_many_behaviours_without_ids() -> None:
    many = '<head type="NOD"/><face type="facs" au="1"/>' * 2000
    (block,) = read(f"<act><bml>{many}</bml></act>")
    assert isinstance(block, Block)
    assert len({node.id for node in block.behaviours}) == 4000
