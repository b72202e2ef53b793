"""Tests of the parser of one <bml> element."""

import pytest

from bml_schema import BMLA, CORE, Block, BMLError, Place, Required, SyncRef, Wait, parse, write


def only(inside: str, attributes: str = "id='b'") -> Block:
    return parse(f"<bml {attributes}>{inside}</bml>")


@pytest.mark.parametrize("attributes", ["", "id=''", "id=' '", "id='bml'", "id='a:b'", f"id='{'x' * 257}'"])
def test_parser_needs_a_usable_id(attributes: str) -> None:
    with pytest.raises(BMLError, match="line 1, /bml: id: wanted") as caught:
        only("<head id='h' lexeme='NOD'/>", attributes)
    assert caught.value.path == "/bml"
    assert caught.value.line == 1


def test_parser_reads_the_namespace_with_any_prefix_or_none() -> None:
    plain = parse("<bml id='b'><wait id='w'/></bml>")
    assert parse(f"<bml xmlns='{CORE}' id='b'><wait id='w'/></bml>") == plain
    assert parse(f"<q:bml xmlns:q='{CORE}' id='b'><q:wait id='w'/></q:bml>") == plain


def test_parser_refuses_another_language() -> None:
    with pytest.raises(BMLError, match=r'wanted <bml> in namespace http.*bml-1\.0, got "\{urn:x\}bml"'):
        parse("<bml xmlns='urn:x' id='b'/>")


@pytest.mark.parametrize("word", ["APPEND", "append", " Append "])
def test_parser_reads_composition_in_any_case(word: str) -> None:
    block = only("", f"id='b' composition='{word}'")
    assert block.composition == "APPEND"
    assert not block.problems


def test_parser_takes_an_unknown_composition_as_merge_with_a_problem() -> None:
    block = only("<wait id='w'/>", "id='b' composition='SIDEWAYS'")
    assert block.composition == "MERGE"
    assert len(block.behaviours) == 1
    (problem,) = block.problems
    assert (problem.id, problem.type, problem.fatal) == ("b", "PARSING_FAILURE", False)
    assert problem.text == 'composition: wanted MERGE, APPEND or REPLACE, got "SIDEWAYS"; taken as MERGE'


LISTS = {
    "append_after": "appendAfter",
    "chunk_after": "chunkAfter",
    "prepend_before": "prependBefore",
    "chunk_before": "chunkBefore",
    "interrupt": "interrupt",
    "on_start": "onStart",
}


@pytest.mark.parametrize("field", LISTS)
def test_parser_reads_lists_of_blocks_with_commas_or_empty(field: str) -> None:
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
def test_parser_reads_append_after_in_composition(composition: str, after: tuple[str, ...]) -> None:
    block = only("", f"id='b' composition='{composition}'")
    assert (block.composition, block.append_after, block.problems) == ("MERGE", after, ())


def test_parser_joins_append_after_of_both_places() -> None:
    for attributes in (
        "a:appendAfter='b1,b2' composition='APPEND-AFTER(b2,b3)'",
        "composition='APPEND-AFTER(b1,b2)' a:appendAfter='b3'",
    ):
        block = only("", f"id='b' xmlns:a='{BMLA}' {attributes}")
        assert sorted(block.append_after) == ["b1", "b2", "b3"]


def test_parser_reports_wrong_attributes_of_a_block_and_takes_defaults() -> None:
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


def test_parser_reads_the_character_and_an_empty_one_as_none() -> None:
    assert only("", "id='b' characterId='Alice'").character_id == "Alice"
    block = only("", "id='b' characterId=''")
    assert block.character_id is None
    assert not block.problems


def test_parser_drops_a_behaviour_with_a_fault_and_no_other() -> None:
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


def test_parser_joins_faults_of_one_behaviour_in_one_problem() -> None:
    (problem,) = only("<head id='h' amount='7' start='nobody:end' repetition='0'/>").problems
    assert problem.text == (
        'amount: wanted 0..1, got 7; start: no behaviour "nobody" in this block; '
        "repetition: wanted a whole number 1..100, got 0; lexeme: wanted a word, got none"
    )


def test_parser_reports_a_fault_inside_required_as_fatal() -> None:
    block = only("<required><wait id='a'/><head id='h'/></required><wait id='c'/>")
    assert [(p.id, p.fatal, p.path) for p in block.problems] == [("b:h", True, "/bml/required[1]/head[1]")]


@pytest.mark.parametrize(
    "inside", ["<blink id='x'/>", "<x:y xmlns:x='urn:x' id='x'/>", "<constraint id='x'/>"]
)
def test_parser_reports_an_unknown_element_inside_required_as_fatal(inside: str) -> None:
    assert [p.fatal for p in only(f"<required>{inside}</required>").problems] == [True]


def test_parser_flattens_required_inside_required() -> None:
    block = only("<required><wait id='a'/><required><wait id='c'/></required></required>")
    assert block.children == (Required(children=(Wait(id="a"), Wait(id="c"))),)
    assert block.places["c"] == Place(1, "/bml/required[1]/required[1]/wait[1]")


def test_parser_names_a_behaviour_without_id_by_its_path() -> None:
    block = only("<wait/><wait id='bml'/><wait id='a:b'/><wait id='a b'/>")
    assert not block.behaviours
    assert [p.id for p in block.problems] == ["b:/bml/wait[1]", "b:bml", "b:a:b", "b:a b"]


def test_parser_drops_the_later_of_two_with_one_id() -> None:
    block = only("<wait id='a' duration='1'/>\n<head id='a' lexeme='NOD'/><wait id='c' start='a:end'/>")
    assert block["a"] == Wait(id="a", duration=1.0)
    assert block["c"].syncs == {"start": SyncRef(behaviour="a", sync="end")}
    (problem,) = block.problems
    assert problem.id == "b:a"
    assert problem.text == 'id: wanted one of its own, got "a", which line 1 has'
    assert problem.path == "/bml/head[1]"


def test_parser_drops_the_later_of_two_even_if_the_first_is_bad() -> None:
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
        (
            "<q:blnk xmlns:q='urn:bml-realizer:1' id='x'/>",
            "CUSTOM_BEHAVIOR_NOT_SUPPORTED",
            'no behaviour "{urn:bml-realizer:1}blnk" is known here, did you mean "blink"?',
        ),
    ],
)
def test_parser_drops_unknown_elements_by_name(inside: str, type: str, said: str) -> None:
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
def test_parser_drops_a_behaviour_with_a_reference_to_nothing(point: str, said: str) -> None:
    known = "<head id='nod' lexeme='NOD' repetition='2'/><speech id='s'><text>a<sync id='m'/></text></speech>"
    block = only(f"{known}<wait id='w' start='{point}'/>")
    assert [(p.id, p.text) for p in block.problems] == [("b:w", f"start: {said}")]
    assert [b.id for b in block.behaviours] == ["nod", "s"]


def test_parser_reads_references_forwards_and_to_the_behaviour_itself() -> None:
    block = only("<wait id='a' start='z:end' end='a:start+1'/><wait id='z'/>")
    assert not block.problems
    assert block["a"].syncs["end"] == SyncRef(behaviour="a", sync="start", offset=1.0)


def test_parser_takes_marks_of_an_ssml_description_as_sync_points() -> None:
    speak = "<speak xmlns='http://www.w3.org/2001/10/synthesis'>a<mark name='m'/></speak>"
    inside = f"<description priority='1' type='application/ssml+xml'>{speak}</description>"
    assert not only(f"<speech id='s'>{inside}</speech><wait id='w' start='s:m'/>").problems


def test_parser_does_not_check_references_into_other_blocks() -> None:
    block = only("<wait id='a' start='other:whatever:odd'/>")
    assert block["a"].syncs["start"] == SyncRef(block="other", behaviour="whatever", sync="odd")


def test_parser_reports_text_between_behaviours() -> None:
    block = only("\n oops <wait id='a'/> more")
    assert len(block.behaviours) == 1
    assert [(p.id, p.text) for p in block.problems] == [("b", 'wanted elements, got the text "oops"')]


def test_parser_ignores_comments_and_instructions() -> None:
    block = only("<!-- a --><?b c?><wait id='a'><!-- d --></wait>")
    assert block.children == (Wait(id="a"),)


def test_places_have_line_and_path() -> None:
    block = only("<wait id='a'/>\n<wait\nid='c'/><head id='d' lexeme='NOD'/>")
    assert block.places == {
        "a": Place(1, "/bml/wait[1]"),
        "c": Place(2, "/bml/wait[2]"),
        "d": Place(3, "/bml/head[1]"),
    }


def test_parser_keeps_unknown_attributes() -> None:
    block = only("", "id='b' xmlns:q='urn:q' q:a='1' odd='2' xml:lang='de'")
    assert block.unknown_attributes == {
        "{urn:q}a": "1",
        "odd": "2",
        "{http://www.w3.org/XML/1998/namespace}lang": "de",
    }


def test_parser_refuses_too_many_behaviours() -> None:
    waits = "".join(f"<wait id='w{i}'/>" for i in range(11))
    text = f"<bml id='b'><required>{waits}</required></bml>"
    assert len(parse(text, max_behaviours=11).behaviours) == 11
    with pytest.raises(
        BMLError, match="wanted at most 10 behaviours and constraints in a block, got 11"
    ) as caught:
        parse(text, max_behaviours=10)
    assert caught.value.block == "b"


def test_parser_refuses_too_many_attributes() -> None:
    many = " ".join(f"a{i}=''" for i in range(101))
    assert only(f"<wait id='a' {many}/>").problems[0].text == "wanted at most 100 attributes, got 102"
    with pytest.raises(BMLError, match="wanted at most 100 attributes, got 102"):
        only("", f"id='b' {many}")
