"""Tests of documents with undeclared prefixes."""

import pytest

from bml_schema import BMLA, CORE, BMLSyntaxError, Head, Interrupt, parse, read
from bml_schema.reading.undeclared_prefixes import read_undeclared
from bml_schema.vocabulary import VOCABULARY


def test_undeclared_prefix_of_an_attribute_costs_one_warning() -> None:
    text = f'<bml xmlns="{CORE}" id="b"><head id="h" lexeme="NOD" x:mood="calm"/></bml>'
    block = parse(text)
    assert block["h"] == Head(id="h", lexeme="NOD")
    (problem,) = block.problems
    assert (problem.id, problem.type, problem.dropped) == ("b", "NOT_BML_1_0", False)
    assert problem.text.startswith("prefixes without a declaration: x;")
    assert problem.text.endswith("without a meaning are x:mood")


@pytest.mark.parametrize(
    ("inside", "wanted"),
    [
        ('<q:head q:id="h" q:lexeme="NOD" q:start="1"/>', '<head id="h" lexeme="NOD" start="1"/>'),
        ('<ext:faceFacs id="f" au="4"/>', '<faceFacs id="f" au="4"/>'),
        (
            '<speech id="s"><q:text>a <q:sync id="m"/>b <q:b>c</q:b> d</q:text></speech>',
            '<speech id="s"><text>a <sync id="m"/>b <b>c</b> d</text></speech>',
        ),
        ('<q:wink id="w"/><head id="h" lexeme="NOD"/>', '<head id="h" lexeme="NOD"/>'),
        ('<head id="h" lexeme="NOD" q:lexeme="SHAKE"/>', '<head id="h" lexeme="NOD"/>'),
    ],
)
def test_undeclared_prefix_is_read_as_if_it_were_not_there(inside: str, wanted: str) -> None:
    block = parse(f'<bml id="b">{inside}</bml>')
    assert block == parse(f'<bml id="b">{wanted}</bml>')
    assert len(block.problems) == 1


@pytest.mark.parametrize("inside", ['<q:wink id="w"/>', '<required><q:wink id="w"/></required>'])
def test_undeclared_prefix_of_an_unknown_behaviour_drops_that(inside: str) -> None:
    for head in ('<bml id="b">', f'<bml id="b" xmlns="{CORE}">'):
        (problem,) = parse(f"{head}{inside}</bml>").problems
        assert (problem.id, problem.type, problem.dropped) == ("b:w", "BEHAVIOR_TYPE_NOT_SUPPORTED", True)


def test_undeclared_prefix_that_is_well_known_means_its_namespace() -> None:
    block = parse('<bml id="b" bmla:appendAfter="a"><bmla:interrupt id="i" target="A"/></bml>')
    assert block.append_after == ("a",)
    assert isinstance(block["i"], Interrupt)
    assert (
        parse(f'<q:bml id="b"><i:interrupt xmlns:i="{BMLA}" id="i" target="A"/></q:bml>')["i"] == block["i"]
    )


def test_undeclared_prefix_beside_another_fault_is_a_broken_document() -> None:
    assert read_undeclared(b'<bml id="b"><x:head></bml>', VOCABULARY) is None
    with pytest.raises(BMLSyntaxError):
        parse('<bml id="b"><x:head></bml>')


def test_undeclared_prefix_is_refused_in_strict_bml() -> None:
    with pytest.raises(BMLSyntaxError, match="Namespace prefix x"):
        parse('<bml id="b"><x:head id="h"/></bml>', strict_bml=True)


def test_undeclared_prefixes_of_thousands_of_attributes_are_refused_fast() -> None:
    many = " ".join(f'x:a{n}="1"' for n in range(20_000))
    (refused,) = read(f'<bml id="b"><head id="h" {many}/></bml>')
    assert isinstance(refused, BMLSyntaxError)
