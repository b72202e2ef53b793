"""Tests of the reader of documents: decoding, limits, broken and several documents."""

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from bml_schema import (
    CORE,
    Block,
    BMLError,
    BMLSyntaxError,
    Place,
    Speech,
    SyncRef,
    Wait,
    parse,
    parse_all,
    read,
    write,
)
from bml_schema.documents import MAX_BYTES, MAX_DOCUMENTS
from tests.strategies import blocks

A, B, C = '<bml id="a"/>', '<bml id="b"></bml>', '<bml id="c">\n</bml>'


def ids_and_errors(text: str | bytes) -> list[str]:
    """Return the id of each block and the message of each error."""
    return [found.id if isinstance(found, Block) else str(found) for found in read(text)]


def test_read_several_documents_in_order() -> None:
    assert ids_and_errors(A + B + C) == ["a", "b", "c"]


def test_read_declarations_comments_and_blanks_before_documents() -> None:
    declaration = '<?xml version="1.0" encoding="UTF-8"?>'
    text = f'\ufeff \n{declaration}<!-- <bml id="no"/> -->\n{A}\n{declaration}\ufeff{B}<!---->'
    assert ids_and_errors(text) == ["a", "b"]


def test_read_an_empty_text_gives_nothing() -> None:
    assert ids_and_errors("") == ids_and_errors(" \n\ufeff<!-- nothing -->") == []


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        (
            f"{A}\n<bml id='x'>\n<head</bml>\n{B}",
            ["a", "line 3: not well-formed: error parsing attribute name", "b"],
        ),
        (
            f"<bml id='x'><head>\n{B}",
            ["line 2: not well-formed: Premature end of data in tag head line 1", "b"],
        ),
        (f"<bml id='x'><head></bml>{B}", ["line 1: not well-formed: Opening and ending tag mismatch", "b"]),
        (f"<bml id='x><head id='h'/></bml>{B}", ["line 1: not well-formed", "b"]),
        (f"{A}<bml id='x'>{B}", ["a", "line 1: not well-formed: Premature end", "b"]),
        (f"{A}\noops\n{B}", ["a", 'line 2: wanted <bml>, got "oops"', "b"]),
        (f"{A}\n</bml>\n{B}", ["a", 'line 2: wanted <bml>, got "</bml>"', "b"]),
        (f"{A}</x>", ["a", 'line 1: wanted <bml>, got "</x>"']),
        (f"<bml/>{B}", ["line 1, /bml: id: wanted one, got none", "b"]),
        (f"<!-- {A}", ['line 1: wanted <bml>, got "<!--"', "a"]),
        (f"hello, {A}", ['line 1: wanted <bml>, got "hello,"', "a"]),
        ("<foo/>", ['line 1: wanted <bml>, got "<foo/>"']),
        ("<bml", ["line 1: wanted <bml>"]),
        ("<bml ", ["line 1: not well-formed"]),
    ],
)
def test_read_goes_on_at_the_next_bml_after_a_broken_stretch(text: str, wanted: list[str]) -> None:
    found = ids_and_errors(text)
    assert len(found) == len(wanted)
    assert all(f.startswith(w) for f, w in zip(found, wanted, strict=True)), found


def test_read_errors_have_the_id_if_possible() -> None:
    (error,) = read("<bml xmlns='urn:q' \n id = 'x' ><head</bml>")
    assert isinstance(error, BMLSyntaxError)
    assert error.block == "x"
    assert error.line == 2


@pytest.mark.parametrize(
    "dtd",
    [
        '<!DOCTYPE bml [<!ENTITY a "x"><!ENTITY b "&a;&a;&a;">]>',
        '<!DOCTYPE bml SYSTEM "http://example.org/bml.dtd">',
        '<!DOCTYPE bml [<!ENTITY a SYSTEM "file:///etc/passwd">]  >',
        "<!DOCTYPE bml>",
    ],
)
def test_read_refuses_a_document_with_a_dtd_only(dtd: str) -> None:
    found = list(read(f'{A}\n<?xml version="1.0"?>{dtd}<bml id="x"><wait id="w"/></bml>{B}'))
    error = found[1]
    assert [f.id for f in found if isinstance(f, Block)] == ["a", "b"]
    assert isinstance(error, BMLSyntaxError)
    assert error.text == "wanted a document without DTD and entities, got <!DOCTYPE"
    assert (error.line, error.block) == (2, "x")


def test_read_an_entity_bomb_costs_nothing() -> None:
    entities = '<!ENTITY e0 "lol">' + "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10}">' for i in range(1, 10))
    text = f'<!DOCTYPE bml [{entities}]><bml id="b"><speech id="s"><text>&e9;</text></speech></bml>'
    with pytest.raises(BMLSyntaxError, match="without DTD"):
        parse(text)


@pytest.mark.parametrize("reference", ["&nobody;", "&"])
def test_read_takes_unknown_entities_for_words(reference: str) -> None:
    document = f'<bml id="b"><speech id="s"><text>{reference}</text></speech></bml>'
    with pytest.raises(BMLSyntaxError, match="not well-formed"):
        parse(document, strict_bml=True)
    assert f'"{reference}"' in parse(document).problems[0].text  # it is spoken


@pytest.mark.parametrize("depth", [300, 10_000])
@pytest.mark.parametrize("tag", ["head", "bml", "required"])
def test_read_deep_nesting_is_one_clear_error(tag: str, depth: int) -> None:
    (error,) = read(f'<bml id="b">{f"<{tag}>" * depth}{f"</{tag}>" * depth}</bml>')
    assert isinstance(error, BMLSyntaxError)
    assert "elements nested too deep, wanted at most 256" in str(error)


def test_read_refuses_two_megabytes() -> None:
    text = f'<bml id="b"><speech id="s"><text>{"x" * 2_000_000}</text></speech></bml>'
    with pytest.raises(
        BMLError, match=f"wanted at most {MAX_BYTES} bytes in a document, got 20000"
    ) as caught:
        parse(text)
    assert caught.value.block == "b"
    assert isinstance(parse(text, max_bytes=1 << 22)["s"], Speech)


def test_read_limits_the_bytes_of_each_document() -> None:
    text = '<bml id="b"><speech id="s"><text>ééé</text></speech></bml>'
    assert parse(text, max_bytes=len(text.encode()))
    with pytest.raises(BMLError, match="bytes"):
        parse(text, max_bytes=len(text))
    assert len(list(read(text * 5, max_bytes=len(text.encode())))) == 5


def test_read_limits_the_number_of_documents() -> None:
    found = list(read(A * (MAX_DOCUMENTS + 5)))
    assert len(found) == MAX_DOCUMENTS + 1
    assert "wanted at most 1000 documents in one text" in str(found[-1])
    assert len(list(read(A * 3, max_documents=2))) == 3


HOSTILE = {
    "<": "<" * 300_000,
    "open comments": "<!--" * 60_000,
    "open instructions": "<?" * 90_000,
    "open cdata": "<![CDATA[" * 60_000,
    "open doctypes": "<!DOCTYPE[" * 60_000,
    "brackets": "<!DOCTYPE [" + "] " * 200_000,
    "open tags": "<bml " * 90_000,
    "open quotes": '<bml a="' * 60_000,
    "blocks that never end": '<bml id="a">' * 40_000,
    "ends that never began": "</bml>" * 90_000,
    "half ends": "</bml " * 90_000,
    "blanks": "<bml" + " " * 500_000,
    "a long name": "<" + "a" * 500_000 + ":bml",
    "attributes": '<bml id="a"><wait id="w" ' + " ".join(f'a{i}="1"' for i in range(60_000)) + "/></bml>",
    "namespaces": '<bml id="a" '
    + " ".join(f'xmlns:a{i}="u{i}"' for i in range(9_000))
    + f'><wait id="w"><description priority="1" type="x">{"<q/>" * 50_000}</description></wait></bml>',
    "more than enough": "<!-- -->" * 100_001,
}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE.keys())
def test_read_hostile_texts_gives_few_errors(text: str) -> None:
    # Each of them once took minutes or gave a flood of warnings.
    assert 1 <= len(list(read(text))) <= MAX_DOCUMENTS + 1


def test_parse_all_returns_the_blocks_of_several_documents() -> None:
    assert [block.id for block in parse_all('<bml id="a"/><bml id="b"/>')] == ["a", "b"]
    with pytest.raises(BMLError, match=r"wanted one document, got 2; .*parse_all"):
        parse('<bml id="a"/><bml id="b"/>')
    with pytest.raises(BMLSyntaxError):
        parse_all('<bml id="a"/><bml id="b">')
    with pytest.raises(BMLSyntaxError, match="empty"):
        parse_all("")


def test_read_decodes_bytes_by_mark_declaration_or_as_utf8() -> None:
    text = '<bml id="ä"/>'
    assert ids_and_errors(text.encode()) == ["ä"]
    assert ids_and_errors(text.encode("utf-8-sig")) == ["ä"]
    assert ids_and_errors(text.encode("utf-16")) == ["ä"]
    declared = f'<?xml version="1.0" encoding="ISO-8859-1"?>{text}'
    assert ids_and_errors(declared.encode("latin-1")) == ["ä"]
    assert ids_and_errors(declared) == ["ä"]


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b'<bml id="a">\n\xff\0</bml>', "line 2: wanted utf-8, got the byte 0xFF"),
        (
            b'<?xml version="1.0" encoding="punycode"?><bml id="\xff"/>',
            'encoding: wanted UTF-8, UTF-16 or Latin, got "punycode"',
        ),
        (
            b'<?xml version="1.0" encoding="nonsense"?><bml id="\xff"/>',
            'encoding: wanted UTF-8, UTF-16 or Latin, got "nonsense"',
        ),
    ],
)
def test_read_undecodable_bytes_is_one_error(data: bytes, said: str) -> None:
    assert ids_and_errors(data) == [said]


@pytest.mark.parametrize("bad", ["\0", "\x1b", "\ud800", "\uffff"])
def test_read_characters_xml_cannot_hold_is_an_error_with_a_line(bad: str) -> None:
    (error,) = read(f'<bml id="b">\n{bad}</bml>')
    assert isinstance(error, BMLSyntaxError)
    assert error.line == 2


def test_read_ignores_marks_inside_cdata_and_comments() -> None:
    text = (
        '<bml id="a"><speech id="s"><text><![CDATA[</bml><bml id="x">]]></text></speech><!-- </bml> --></bml>'
    )
    assert ids_and_errors(text + B) == ["a", "b"]
    speech = parse(text)["s"]
    assert isinstance(speech, Speech)
    assert str(speech.text) == '</bml><bml id="x">'


@pytest.mark.parametrize("text", ["", A + B, A + "oops"])
def test_parse_refuses_none_and_several_documents(text: str) -> None:
    with pytest.raises(BMLError, match=r"wanted"):
        parse(text)


def test_parse_strict_raises_the_first_problem() -> None:
    text = '<bml id="b">\n<head id="h"/><wait id="w"/></bml>'
    assert len(parse(text).behaviours) == 1
    with pytest.raises(
        BMLError, match=r"^line 2, /bml/head\[1\]: lexeme: wanted a word, got none$"
    ) as caught:
        parse(text, strict=True)
    assert caught.value.block == "b"
    assert parse(A, strict=True).id == "a"


def test_read_counts_lines_over_the_whole_text() -> None:
    found = list(read(f'\n{C}\n\n<bml id="x">\n<head id="h"/>\n</bml>'))
    assert isinstance(found[1], Block)
    assert found[1].problems[0].line == 6


WORDS = [
    "<bml ",
    "</bml>",
    "/>",
    ">",
    "<",
    'id="a"',
    "<!--",
    "-->",
    "<![CDATA[",
    "]]>",
    "<?x",
    "?>",
    "&",
    "&lt;",
    "\0",
]
WORDS += [
    "<head ",
    "</head>",
    "<required>",
    "<constraint>",
    '"',
    "<!DOCTYPE x [",
    "]>",
    "\ufeff",
    "é",
    "=",
    "'",
    " x ",
]
SEEDS = [
    f'<bml xmlns="{CORE}" id="b"><speech id="s"><text>a<sync id="m"/>b</text></speech><head id="h" '
    'lexeme="NOD" stroke="s:m - 0.5" amount="0.5"/>'
    '<required><face id="f"><faceLexeme lexeme="SMILE"/></face></required><constraint>'
    '<before ref="h:end"><sync ref="f:start+1"/></before></constraint></bml>',
    A + C,
]


@given(st.lists(st.sampled_from(WORDS), max_size=25).map("".join) | st.text(max_size=40))
@example("<bml id='a'/>" * 3)
def test_read_any_text_gives_blocks_and_errors_only(text: str) -> None:
    for found in read(text):
        assert isinstance(found, Block | BMLError)
        if isinstance(found, Block):
            assert parse(write(found)) == found


@given(st.data())
def test_read_a_mutated_document_gives_blocks_and_errors_only(data: st.DataObject) -> None:
    text = data.draw(st.sampled_from(SEEDS) | blocks().map(write))
    for _ in range(data.draw(st.integers(1, 4))):
        start = data.draw(st.integers(0, len(text)))
        end = data.draw(st.integers(start, min(len(text), start + 12)))
        middle = data.draw(
            st.sampled_from(["", *WORDS, "nan", "1e308", ":", "-", "+ 1", "h", text[start:end] * 2])
        )
        text = text[:start] + middle + text[end:]
    for found in read(text):
        assert isinstance(found, Block | BMLError)
        if isinstance(found, Block):
            assert parse(write(found)) == found
            ids = [b.id for b in found.behaviours]
            assert len(ids) == len(set(ids))


@given(st.binary(max_size=60) | st.lists(st.sampled_from(WORDS)).map(lambda w: "".join(w).encode("utf-16")))
def test_read_any_bytes_gives_blocks_and_errors_only(data: bytes) -> None:
    assert all(isinstance(found, Block | BMLError) for found in read(data))


@pytest.mark.parametrize(
    ("text", "read_as"),
    [
        ('<bml id="a"/><bml id="x"><head lexeme=</bml> junk <bml id="b"/>', ["a", None, "b"]),
        ('<bml id="a"/><bml id="x"><head <<< &<bml id="b"><wait id="w"/></bml></bml> rest', ["a", None, "b"]),
        ('<bml id="x"><bml id="y"><broken</bml></bml><bml id="z"/>', [None, "z"]),
    ],
)
def test_read_reports_a_broken_stretch_once_and_keeps_good_documents(
    text: str, read_as: list[object]
) -> None:
    assert [x.id if isinstance(x, Block) else None for x in read(text)] == read_as


def test_read_ignores_the_act_around_smartbodys_documents() -> None:
    inner = '<bml id="b"><q:head id="x"/>\n<wait id="w" start="1"/></bml>'
    text = f'<?xml version="1.0"?>\n<act xmlns:q="{CORE}"><participant id="Brad" role="actor"/>{inner}</act>'
    block = parse(text)
    assert block.children == (Wait(id="w", syncs={"start": SyncRef(offset=1.0)}),)
    assert [p.line for p in block.problems] == [2]
    assert block.places["w"] == Place(3, "/bml/wait[1]")


def test_read_an_act_with_several_documents_and_several_acts() -> None:
    assert ids_and_errors(f"<act>{A}{B}</act>") == ["a", "b"]
    assert ids_and_errors(f"<act>{A}</act>\n<act><participant id='p'></participant>{B}</act>") == ["a", "b"]
    assert ids_and_errors(f"<act>{A}<bml id='x'><head </bml></act>{B}")[0::2] == ["a", "b"]


def test_read_reports_text_in_an_act() -> None:
    assert ids_and_errors(f"<act>{A}</act>oops <active/>") == [
        "a",
        'line 1: wanted <bml>, got "oops <active/>"',
    ]
    assert ids_and_errors("<act/>") == []


LONG = """<bml
    id="b">
  <head
    id="h"
    lexeme="NOD"
  /><wait id="w"/>
  <face id="f"><faceLexeme
     lexeme="SMILE" amount="7"/></face>
  <!-- <wait
  --><gaze id="g"
/>
</bml>"""


def test_read_lines_of_elements_are_where_their_tags_begin() -> None:
    block = parse(LONG)
    assert block.places == {"h": Place(3, "/bml/head[1]"), "w": Place(6, "/bml/wait[1]")}
    assert [(p.id, p.line) for p in block.problems] == [("b:f", 7), ("b:g", 10)]
    assert [p.line for p in list(read(f"\n{A}\n{LONG}"))[1].problems] == [9, 12]  # type: ignore[union-attr]


def test_read_long_tags_without_end_in_linear_time() -> None:
    text = (
        f'<bml id="b"><speech id="s"><text><![CDATA[{"<a" * 90_000}{"<a" + chr(10)}]]></text></speech></bml>'
    )
    assert isinstance(parse(text)["s"], Speech)
    text = text.replace("<a", "<a\n")
    assert isinstance(parse(text)["s"], Speech)


@given(blocks())
def test_read_gives_the_same_for_one_document_and_for_one_among_others(block: Block) -> None:
    text = write(block)
    alone, *_ = read(text)
    _, among = read(A + text)
    assert isinstance(alone, Block)
    assert isinstance(among, Block)
    assert (alone, alone.places) == (among, among.places)


def test_read_a_page_of_html_says_what_came_instead_of_bml() -> None:
    (error,) = read("<!DOCTYPE html>\n<html><body>Hello</body></html>")
    assert isinstance(error, BMLError)
    assert error.text == 'wanted <bml>, got "<!DOCTYPE html>\n<html><body>Hello</body></html>"'


@pytest.mark.parametrize("text", [None, 3, ["<bml id='b'/>"]])
def test_parse_refuses_what_is_no_text(text: object) -> None:
    with pytest.raises(TypeError, match="text: wanted str or bytes, got"):
        parse(text)  # type: ignore[arg-type]
