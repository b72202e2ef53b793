"""Who pays for a fault: the block, one behaviour, or nobody."""

from __future__ import annotations

import pytest

from bml_schema import BMLA, CORE, Block, BMLError, Place, Required, SyncRef, Wait, parse, write


def only(inside: str, attributes: str = "id='b'") -> Block:
    return parse(f"<bml {attributes}>{inside}</bml>")


@pytest.mark.parametrize("attributes", ["", "id=''", "id=' '", "id='bml'", "id='a:b'", f"id='{'x' * 257}'"])
def test_without_a_usable_id_there_is_no_block(attributes: str) -> None:
    with pytest.raises(BMLError, match="line 1, /bml: id: wanted") as caught:
        only("<head id='h' lexeme='NOD'/>", attributes)
    assert caught.value.path == "/bml"
    assert caught.value.line == 1


def test_a_document_may_have_the_namespace_any_prefix_or_none() -> None:
    plain = parse("<bml id='b'><wait id='w'/></bml>")
    assert parse(f"<bml xmlns='{CORE}' id='b'><wait id='w'/></bml>") == plain
    assert parse(f"<q:bml xmlns:q='{CORE}' id='b'><q:wait id='w'/></q:bml>") == plain


def test_another_language_is_refused() -> None:
    with pytest.raises(BMLError, match=r'wanted <bml> in namespace http.*bml-1\.0, got "\{urn:x\}bml"'):
        parse("<bml xmlns='urn:x' id='b'/>")


@pytest.mark.parametrize("word", ["APPEND", "append", " Append "])
def test_composition_is_read_in_any_case(word: str) -> None:
    block = only("", f"id='b' composition='{word}'")
    assert block.composition == "APPEND"
    assert not block.problems


def test_an_unknown_composition_is_told_of_and_taken_as_merge() -> None:
    block = only("<wait id='w'/>", "id='b' composition='BLEND'")
    assert block.composition == "MERGE"
    assert len(block.behaviours) == 1
    (problem,) = block.problems
    assert (problem.id, problem.type, problem.fatal) == ("b", "PARSING_FAILURE", False)
    assert problem.text == 'composition: wanted MERGE, APPEND or REPLACE, got "BLEND"; taken as MERGE'


LISTS = {
    "append_after": "appendAfter",
    "chunk_after": "chunkAfter",
    "prepend_before": "prependBefore",
    "chunk_before": "chunkBefore",
    "interrupt": "interrupt",
    "on_start": "onStart",
}


@pytest.mark.parametrize("field", LISTS)
def test_bmlas_lists_of_blocks_have_commas_and_may_be_empty(field: str) -> None:
    def read(listed: str) -> object:
        block = only("", f"id='b' xmlns:a='{BMLA}' a:{LISTS[field]}='{listed}'")
        assert not block.problems
        assert parse(write(block)) == block
        return getattr(block, field)

    assert read("b1, my block ,b-3") == ("b1", "my block", "b-3")
    assert read("b1") == ("b1",)
    assert read("") == read(" , ") == ()
    assert read("b1,b,b2") == ("b1", "b2"), "a block cannot wait for itself"


@pytest.mark.parametrize(
    ("composition", "after"),
    [
        ("APPEND-AFTER(b1,b2)", ("b1", "b2")),
        (" append-after ( b1 , b2 ) ", ("b1", "b2")),
        ("APPEND-AFTER()", ()),
        ("APPEND-AFTER(b)", ()),
    ],
)
def test_append_after_may_stand_in_the_composition(composition: str, after: tuple[str, ...]) -> None:
    block = only("", f"id='b' composition='{composition}'")
    assert (block.composition, block.append_after, block.problems) == ("MERGE", after, ())


def test_append_after_in_both_places_is_both() -> None:
    for attributes in (
        "a:appendAfter='b1,b2' composition='APPEND-AFTER(b2,b3)'",
        "composition='APPEND-AFTER(b1,b2)' a:appendAfter='b3'",
    ):
        block = only("", f"id='b' xmlns:a='{BMLA}' {attributes}")
        assert sorted(block.append_after) == ["b1", "b2", "b3"]


def test_wrong_attributes_of_a_block_are_one_problem_and_leave_their_defaults() -> None:
    attributes = "composition='MIX' a:preplan='maybe' a:chunkAfter='a:b' a:appendAfter='bml' a:onStart='b2'"
    block = only("<wait id='w'/>", f"id='b' xmlns:a='{BMLA}' {attributes}")
    assert block == Block(id="b", on_start=("b2",), children=(Wait(id="w"),))
    (problem,) = block.problems
    assert (problem.id, problem.type, problem.fatal) == ("b", "PARSING_FAILURE", False)
    assert problem.text == (
        'composition: wanted MERGE, APPEND or REPLACE, got "MIX"; taken as MERGE; '
        'preplan: wanted true or false, got "maybe"; taken as false; '
        'chunkAfter: wanted names of blocks with commas between them, got "a:b"; taken as none; '
        'appendAfter: wanted names of blocks with commas between them, got "bml"; taken as none'
    )


def test_the_character_is_read_and_an_empty_one_is_none() -> None:
    assert only("", "id='b' characterId='Alice'").character_id == "Alice"
    block = only("", "id='b' characterId=''")
    assert block.character_id is None
    assert not block.problems


def test_a_fault_drops_its_behaviour_and_no_other() -> None:
    block = only("<wait id='a'/>\n<head id='h' lexeme='NOD' amount='7'/>\n<wait id='c'/>")
    assert [b.id for b in block.behaviours] == ["a", "c"]
    (problem,) = block.problems
    assert (problem.id, problem.type, problem.line, problem.path) == (
        "b:h",
        "PARSING_FAILURE",
        2,
        "/bml/head[1]",
    )
    assert str(problem) == "line 2, /bml/head[1]: amount: wanted 0..1, got 7"


def test_several_faults_of_one_behaviour_are_one_problem() -> None:
    (problem,) = only("<head id='h' amount='7' start='nobody:end' repetition='0'/>").problems
    assert problem.text == (
        'amount: wanted 0..1, got 7; start: no behaviour "nobody" in this block; '
        "repetition: wanted a whole number 1..100, got 0; lexeme: wanted a word, got none"
    )


def test_a_fault_inside_required_is_fatal() -> None:
    block = only("<required><wait id='a'/><head id='h'/></required><wait id='c'/>")
    assert [(p.id, p.fatal, p.path) for p in block.problems] == [("b:h", True, "/bml/required[1]/head[1]")]


@pytest.mark.parametrize(
    "inside", ["<blink id='x'/>", "<x:y xmlns:x='urn:x' id='x'/>", "<constraint id='x'/>"]
)
def test_what_is_not_known_inside_required_is_fatal_too(inside: str) -> None:
    assert [p.fatal for p in only(f"<required>{inside}</required>").problems] == [True]


def test_a_required_inside_a_required_adds_nothing() -> None:
    block = only("<required><wait id='a'/><required><wait id='c'/></required></required>")
    assert block.children == (Required(children=(Wait(id="a"), Wait(id="c"))),)
    assert block.places["c"] == Place(1, "/bml/required[1]/required[1]/wait[1]")


def test_a_behaviour_without_id_is_told_of_by_its_path() -> None:
    block = only("<wait/><wait id='bml'/><wait id='a:b'/><wait id='a b'/>")
    assert not block.behaviours
    assert [p.id for p in block.problems] == ["b:/bml/wait[1]", "b:bml", "b:a:b", "b:a b"]


def test_of_two_same_ids_the_later_goes() -> None:
    block = only("<wait id='a' duration='1'/>\n<head id='a' lexeme='NOD'/><wait id='c' start='a:end'/>")
    assert block["a"] == Wait(id="a", duration=1.0)
    assert block["c"].syncs == {"start": SyncRef(behaviour="a", sync="end")}
    (problem,) = block.problems
    assert problem.id == "b:a"
    assert problem.text == 'id: wanted one of its own, got "a", which line 1 has'
    assert problem.path == "/bml/head[1]"


def test_the_later_goes_even_when_the_first_is_bad() -> None:
    block = only("<wait id='a' duration='x'/><wait id='a'/><wait id='c' start='a:end'/>")
    assert block.behaviours == (Wait(id="c"),)
    assert [p.id for p in block.problems] == ["b:a", "b:a"]
    assert [p.lost_references for p in block.problems] == [("c:start",), ()]


@pytest.mark.parametrize(
    ("inside", "type", "said"),
    [
        ("<wiggle id='x'/>", "BEHAVIOR_TYPE_NOT_SUPPORTED", "no behaviour <wiggle> in BML 1.0"),
        (
            "<haed id='x'/>",
            "BEHAVIOR_TYPE_NOT_SUPPORTED",
            'no behaviour <haed> in BML 1.0, did you mean "head"?',
        ),
        ("<bml id='x'/>", "BEHAVIOR_TYPE_NOT_SUPPORTED", "no behaviour <bml> in BML 1.0"),
        (
            "<q:a xmlns:q='urn:q' id='x'/>",
            "CUSTOM_BEHAVIOR_NOT_SUPPORTED",
            'no behaviour "{urn:q}a" is known here',
        ),
    ],
)
def test_unknown_elements_are_dropped_by_name(inside: str, type: str, said: str) -> None:
    assert [(p.id, p.type, p.text) for p in only(inside).problems] == [("b:x", type, said)]


@pytest.mark.parametrize(
    ("point", "said"),
    [
        ("qqq:end", 'no behaviour "qqq" in this block'),
        ("hod:end", 'no behaviour "hod" in this block, did you mean "nod"?'),
        ("nod:attackPeak", 'no sync point "attackPeak" on "nod"'),
        ("nod:stroke:3", 'wanted stroke:1..2 of "nod", got stroke:3'),
        ("s:mid", 'no sync point "mid" on "s"'),
    ],
)
def test_a_reference_that_leads_nowhere_drops_who_holds_it(point: str, said: str) -> None:
    known = "<head id='nod' lexeme='NOD' repetition='2'/><speech id='s'><text>a<sync id='m'/></text></speech>"
    block = only(f"{known}<wait id='w' start='{point}'/>")
    assert [(p.id, p.text) for p in block.problems] == [("b:w", f"start: {said}")]
    assert [b.id for b in block.behaviours] == ["nod", "s"]


def test_references_lead_forwards_and_to_oneself() -> None:
    block = only("<wait id='a' start='z:end' end='a:start+1'/><wait id='z'/>")
    assert not block.problems
    assert block["a"].syncs["end"] == SyncRef(behaviour="a", sync="start", offset=1.0)


def test_the_marks_of_an_ssml_description_are_sync_points() -> None:
    speak = "<speak xmlns='http://www.w3.org/2001/10/synthesis'>a<mark name='m'/></speak>"
    inside = f"<description priority='1' type='application/ssml+xml'>{speak}</description>"
    assert not only(f"<speech id='s'>{inside}</speech><wait id='w' start='s:m'/>").problems


def test_references_into_other_blocks_are_not_looked_up() -> None:
    block = only("<wait id='a' start='other:whatever:odd'/>")
    assert block["a"].syncs["start"] == SyncRef(block="other", behaviour="whatever", sync="odd")


def test_text_between_behaviours_is_told_of_and_costs_nothing() -> None:
    block = only("\n oops <wait id='a'/> more")
    assert len(block.behaviours) == 1
    assert [(p.id, p.text) for p in block.problems] == [("b", 'wanted elements, got the text "oops"')]


def test_comments_and_instructions_are_not_seen() -> None:
    block = only("<!-- a --><?b c?><wait id='a'><!-- d --></wait>")
    assert block.children == (Wait(id="a"),)


def test_places_tell_line_and_path() -> None:
    block = only("<wait id='a'/>\n<wait\nid='c'/><head id='d' lexeme='NOD'/>")
    assert block.places == {
        "a": Place(1, "/bml/wait[1]"),
        "c": Place(2, "/bml/wait[2]"),
        "d": Place(3, "/bml/head[1]"),
    }


def test_attributes_nobody_knows_are_kept() -> None:
    block = only("", "id='b' xmlns:q='urn:q' q:a='1' odd='2' xml:lang='de'")
    assert block.unknown_attributes == {
        "{urn:q}a": "1",
        "odd": "2",
        "{http://www.w3.org/XML/1998/namespace}lang": "de",
    }


def test_too_many_behaviours_are_refused() -> None:
    waits = "".join(f"<wait id='w{i}'/>" for i in range(11))
    text = f"<bml id='b'><required>{waits}</required></bml>"
    assert len(parse(text, max_behaviours=11).behaviours) == 11
    with pytest.raises(
        BMLError, match="wanted at most 10 behaviours and constraints in a block, got 11"
    ) as caught:
        parse(text, max_behaviours=10)
    assert caught.value.block == "b"


def test_too_many_attributes_are_refused_or_drop_their_behaviour() -> None:
    many = " ".join(f"a{i}=''" for i in range(101))
    assert only(f"<wait id='a' {many}/>").problems[0].text == "wanted at most 100 attributes, got 102"
    with pytest.raises(BMLError, match="wanted at most 100 attributes, got 102"):
        only("", f"id='b' {many}")
