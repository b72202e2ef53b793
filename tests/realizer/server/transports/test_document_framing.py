"""The splitter of streams into documents: cuts, garbage and limits."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.server.transports.document_framing import DocumentFramer, Fault
from tests.rows import each_row

LIMIT = 300
NOD = '<bml id="b"><head id="n" lexeme="NOD"/></bml>'


def assemble(data: bytes | str, *, limit: int = LIMIT, step: int | None = None) -> list[str | Fault]:
    data = data.encode() if isinstance(data, str) else data
    framer = DocumentFramer(limit)
    reads = [data] if step is None else [data[n : n + step] for n in range(0, len(data), step)]
    return [found for read in reads for found in framer.feed(read)]


WHOLE = {
    "plain": NOD,
    "empty": '<bml id="b"/>',
    "prefix": '<b:bml xmlns:b="urn:x" id="b"><b:wait id="w"/></b:bml>',
    "lines": '<bml\n  id="b"\n>\n<wait\r\nid="w"/>\n</bml\n>',
    "end tag in CDATA": '<bml id="b"><text><![CDATA[</bml> <bml id="x">]]></text></bml>',
    "end tag in a comment": '<bml id="b"><!-- </bml> <bml> --><wait id="w"/></bml>',
    "end tag in an instruction": '<bml id="b"><?x </bml>?></bml>',
    "greater than in a value": """<bml id="a>b/>" x='"/>'><wait id="w"/></bml>""",
    "other elements whose names begin alike": '<bml id="b"><bmlx></bmlx><x:bml-y/></bml>',
    "letters of two bytes": '<bml id="é"><speech id="s"><text>Größe 😀</text></speech></bml>',
}
BETWEEN = {
    "nothing": "",
    "blanks": " \t\r\n\r\n",
    "mark of order": "\ufeff",
    "declaration": '<?xml version="1.0" encoding="UTF-8"?>\n',
    "comment": "<!-- <bml> -- > -->",
    "doctype": '<!DOCTYPE bml SYSTEM "bml.dtd">',
    "wrapper": '<act><participant id="Brad"/>',
    "wrapper with a prolog": '<?xml version="1.0"?><!DOCTYPE fml-apml SYSTEM "fml-apml.dtd" []><fml-apml>',
    "end of a wrapper": "</act>\n<act>",
    "functions": '</fml-apml><fml-apml><fml><x y="</bml>"/><bml id="no"/></fml><fml/>',
    "doctype with subset": '<!DOCTYPE bml [<!ELEMENT bml ANY> <!ATTLIST bml id CDATA "x">\n ] >',
}


@each_row("document", WHOLE.values())
@each_row("between", BETWEEN.values())
@each_row("step", [None, 1, 7])
def test_framer_returns_documents_as_they_were_sent(document: str, between: str, step: int | None) -> None:
    stream = between + document + between + document + "\n"
    assert assemble(stream, step=step) == [document, document]


BROKEN = {
    "stray text": ("hello\n", "got 'hello'"),
    "another element": ("<body>\n<fml/>\n</body>", "got '<body>'"),
    "a wrapper without its end": ("<act <", "wanted the end of a tag, got '<act '"),
    "a wrapper with a value without its end": ("<act x='" + "y" * LIMIT, "at most"),
    "endless participants": ("<act>" + "<participant/>" * 300, "wanted the end of a tag"),
    "an <fml> without its end": (f"<fml-apml><fml>{'y' * LIMIT}", "wanted an end of <fml"),
    "an end tag": ("</bml>", "got </bml> without <bml"),
    "a document without its end": ('<bml id="x"><head', "before the next <bml"),
    "a start tag without its end": ('<bml id="x" ', "before the next <bml"),
    "a value without its end": ('<bml id="x', "before the next <bml"),
    "many of them": ("<bml>" * 100, "before the next <bml"),
    "a large document": (f'<bml id="x">{"y" * LIMIT}</bml>', f"at most {LIMIT} bytes"),
    "a large document without its end": (f'<bml id="x">{"y" * LIMIT}', f"at most {LIMIT} bytes"),
    "a comment without its end": (f"<!-- {'y' * LIMIT}", "wanted an end of <!--"),
    "a comment without its end in a document": (f'<bml id="x"><!-- {"y" * LIMIT}', f"at most {LIMIT} bytes"),
    "a doctype without its end": ("<!DOCTYPE bml", "wanted an end of <!DOCTYPE"),
    "a subset without its end": (f"<!DOCTYPE bml [{'y' * LIMIT}", "wanted an end of <!DOCTYPE"),
    "bytes that are no UTF-8": (b'<bml id="x">\xff</bml>', "got the byte 0xFF"),
    "bytes that are nothing": (b"\x00\x01\xfe<\xff<<\n", "wanted <bml>"),
    "CDATA outside": ("<![CDATA[ <bml> ]]>", "outside a document"),
}


@each_row("step", [None, 1, 5])
@each_row("stretch, says", BROKEN.values())
def test_framer_reports_a_broken_span_once_and_goes_on(
    stretch: str | bytes, says: str, step: int | None
) -> None:
    raw = stretch.encode() if isinstance(stretch, str) else stretch
    fault, *documents = assemble(raw + NOD.encode() + b"\n" + NOD.encode(), step=step)
    assert isinstance(fault, Fault)
    assert says in fault.text
    assert fault.block == ("x" if b'id="x"' in raw else None)
    assert documents == [NOD, NOD]


@pytest.mark.parametrize("step", [None, 1, 7])
def test_framer_returns_documents_in_the_element_around_them(step: int | None) -> None:
    brad, greta = '<act><participant id="Brad"/>', "<fml-apml>"
    stream = f"{NOD}{brad}{NOD}{NOD}</act>{NOD}{greta}{NOD}<fml><bml/></fml></fml-apml>\n<act/>{NOD}"
    framer, found = DocumentFramer(LIMIT, wraps=True), list[str | Fault]()
    data = stream.encode()
    for n in range(0, len(data), step or len(data)):
        found += framer.feed(data[n : n + (step or len(data))])
    wrapped = f"{brad}{NOD}</act>"
    assert found == [NOD, wrapped, wrapped, NOD, f"{greta}{NOD}</fml-apml>", NOD]


def test_framer_reports_each_document_without_an_end_also_after_other_faults() -> None:
    found = assemble(f'<foo/><bml id="f"><bml id="g"><head id="h">{NOD}')
    assert [item.block for item in found if isinstance(item, Fault)] == [None, "f", "g"]
    assert [item for item in found if isinstance(item, str)] == [NOD]


def test_framer_reports_no_fault_for_the_end_of_a_document_given_up() -> None:
    found = assemble(f'<bml id="x"> {NOD} </bml> {NOD}')
    assert [type(f) for f in found] == [Fault, str, str]


def test_framer_returns_nothing_for_half_a_document() -> None:
    framer = DocumentFramer(LIMIT)
    assert framer.feed(NOD[:-1].encode()) == []
    assert framer.feed(b">") == [NOD]


PIECES = [
    *WHOLE.values(),
    *BETWEEN.values(),
    *(s if isinstance(s, str) else s.decode("latin-1") for s, _ in BROKEN.values()),
    *("<", ">", '"', "'", "/", "-->", "]]>", "?>", "]", "<bml", "</bml", "bml", ":", "\n", "x" * 61),
]


@given(st.lists(st.sampled_from(PIECES), max_size=8), st.lists(st.integers(0, 400), max_size=30))
def test_framer_does_not_depend_on_how_a_stream_is_cut(pieces: list[str], cuts: list[int]) -> None:
    data = "".join(pieces).encode("latin-1", "replace")
    framer = DocumentFramer(LIMIT)
    found: list[str | Fault] = []
    at = 0
    for cut in cuts:
        found += framer.feed(data[at : at + cut])
        at += cut
    found += framer.feed(data[at:])
    assert found == assemble(data) == assemble(data, step=1)


@given(st.binary(max_size=600))
def test_framer_finds_the_next_document_after_any_bytes(garbage: bytes) -> None:
    stream = garbage + b"\n" + NOD.encode() * 20  # one of them ends any construct that the garbage has begun
    assert assemble(stream)[-1] == NOD


def test_framer_bounds_what_it_stores() -> None:
    framer = DocumentFramer(1000)
    for junk in (b"x" * 999, b"<bml>" * 200, b"<!--" + b"y" * 900, b'<bml id="b">' + b"z" * 900, b"<" * 999):
        for _ in range(50):
            framer.feed(junk)
            assert len(framer._data) <= 3000


@pytest.mark.parametrize("inside", ["{}", "<!--{}-->", "<![CDATA[{}]]>", "<?x {}?>", '<wait id="{}"/>'])
def test_framer_does_not_parse_a_slow_document_again_from_its_start(inside: str) -> None:
    data = f'<bml id="{"v" * 2000}">{inside.format("ab < ]] -- ? " * 200)}</bml>'.encode()
    framer = DocumentFramer(2**20)
    for n in range(len(data) - 1):
        assert framer.feed(data[n : n + 1]) == []
        # Bytes that each new byte makes it examine again: never more than the longest mark.
        assert len(framer._data) - framer._parsed <= 80
    assert framer.feed(data[-1:]) == [data.decode()]
