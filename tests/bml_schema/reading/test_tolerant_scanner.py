"""Tests of the tolerant scanner."""

import pytest

from bml_schema.reading.tolerant_scanner import scan


def test_scan_has_parents_numbers_and_places_of_values() -> None:
    text = "<?a <b?><x:bml id='one'><a/><!-- <a/> --><b n = \"2>\"><a/></b><a></a></x:bml><c/>"
    elements, slips = scan(text)
    assert not slips
    assert [(e.name, e.parent, e.nth, e.root) for e in elements] == [
        ("x:bml", -1, 1, 0),
        ("a", 0, 1, 0),
        ("b", 0, 1, 0),
        ("a", 2, 1, 0),
        ("a", 0, 2, 0),
        ("c", -1, 1, -1),
    ]
    start, end = elements[2].attributes["n"]
    assert text[start:end] == "2>"
    assert text[elements[2].offset : elements[2].end] == '<b n = "2>">'


@pytest.mark.parametrize(
    ("text", "said", "place"),
    [
        ("<bml id='a'><x></y></bml>", "wanted </x>, got </y>", "</y"),
        ("<bml id='a'>", "<bml> is never closed", ">"),
        ("<bml id=a/>", "wanted quotes around the value of id", "a/"),
        ("<bml id/>", 'wanted id="...", got no value', "id"),
        ("<bml id='a' id='b'/>", "id is given twice", "id"),
        ("<bml id='a>", "the value of id is never closed by '", "'a"),
        ("<bml id='a'>&nbsp;</bml>", "no entity &nbsp; in XML, write the character itself", "&nbsp;"),
        ("<bml id='&'/>", "wanted &amp; for the character &", "&"),
        ("</bml>", "</bml> closes nothing", "</bml"),
        ("<bml id='a'><!-- </bml>", "<!-- is never closed by -->", "<!--"),
        ("<bml id='a' <x/></bml>", "wanted an attribute or the end of <bml>", "<"),
    ],
)
def test_scan_names_what_is_not_well_formed(text: str, said: str, place: str) -> None:
    _, slips = scan(text)
    slip = next(s for s in slips if s.text == said)
    assert text[slip.offset : slip.offset + slip.length] == place


@pytest.mark.parametrize("piece", ["<a>", "<!--", "</a>", "<bml id='", "&", "<a b='c' ", "<bml>", "<a\n"])
def test_scan_takes_hostile_texts(piece: str) -> None:
    # A scan that was not linear in the text would take hours.
    elements, slips = scan(piece * 50_000)
    assert slips
    assert len(elements) in (0, 50_000)
