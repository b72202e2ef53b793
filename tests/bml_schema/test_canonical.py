"""Tests of canonical XML text."""

import pytest
from lxml import etree

from bml_schema.canonical import MAX_ATTRIBUTES, canonical
from bml_schema.errors import Fault


def text_of(document: str) -> str:
    return canonical(etree.fromstring(document.encode())[0])


def test_canonical_does_not_depend_on_prefixes_and_surroundings() -> None:
    plain = text_of('<x><a xmlns="urn:a" xmlns:q="urn:q" q:k="1"><b/></a></x>')
    prefixed = text_of(
        '<x xmlns:z="urn:a" xmlns:y="urn:q" xmlns:w="urn:w"><z:a y:k="1"><z:b></z:b></z:a></x>'
    )
    assert plain == prefixed == '<a xmlns="urn:a" xmlns:p1="urn:q" p1:k="1"><b/></a>'


def test_canonical_keeps_an_element_without_namespace() -> None:
    assert text_of('<x><a xmlns="urn:a"><b xmlns=""/>t</a></x>') == '<a xmlns="urn:a"><b xmlns=""/>t</a>'


@pytest.mark.parametrize(
    "inner", ["<a/>", "<a> x &amp; &lt;y&gt; </a>", '<a b="&quot;&#10;" xml:lang="de"><c/>t<c>u</c></a>']
)
def test_canonical_of_canonical_text_is_the_same(inner: str) -> None:
    once = text_of(f"<x>{inner}</x>")
    assert text_of(f"<x>{once}</x>") == once


def test_attributes_refuses_too_many() -> None:
    many = " ".join(f'a{i}="1"' for i in range(MAX_ATTRIBUTES + 1))
    with pytest.raises(Fault, match="wanted at most 100 attributes, got 101"):
        text_of(f"<x><a {many}/></x>")
