"""Tests of the XML schemas against node classes, the parser and the writer."""

from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from lxml import etree

from bml_schema import (
    BMLA,
    BMLT,
    CORE,
    EXTENSIONS,
    OWN,
    After,
    Before,
    Behaviour,
    Block,
    Constraint,
    Description,
    FaceInterpolator,
    Fap,
    Pose,
    Required,
    SpeechText,
    Stance,
    Sync,
    Synchronize,
    Trajectory,
    parse,
    write,
)
from bml_schema.node_schema import Attribute, schema_of
from realizer.behaviours.registry import VOCABULARY
from tests import schema
from tests.rows import each_row
from tests.strategies import blocks

XSD = Path(str(files("bml_schema") / "xsd"))
XS = "{http://www.w3.org/2001/XMLSchema}"
FILES = {
    CORE: "bml-1.0.xsd",
    EXTENSIONS: "coreextensions-1.0.xsd",
    BMLA: "bmla.xsd",
    BMLT: "bmlt.xsd",
    OWN: "realizer-1.xsd",
}
SCHEMAS = {space: etree.parse(XSD / name).getroot() for space, name in FILES.items()}
SCHEMA = etree.XMLSchema(etree.parse(XSD / "realizer-1.xsd"))  # it imports the others
PREFIXES = {"bml": CORE, "ext": EXTENSIONS, "bmla": BMLA, "bmlt": BMLT, "realizer": OWN}

Element = etree._Element


def named(kind: str, space: str, name: str) -> Element:
    (found,) = [e for e in SCHEMAS[space] if e.tag == XS + kind and e.get("name") == name]
    return found


def referred(kind: str, qname: str) -> Element:
    prefix, _, name = qname.partition(":")
    return named(kind, PREFIXES[prefix], name)


def type_of(element: Element) -> Element:
    """Return the complex type of an element declaration."""
    inner = element.find(XS + "complexType")
    return inner if inner is not None else referred("complexType", element.get("type", ""))


def attributes(declaration: Element) -> dict[str, Element]:
    """Return the attributes of a complex type or an attribute group, by name."""
    found: dict[str, Element] = {}
    for part in declaration:
        if part.tag == XS + "attribute":
            found[part.get("name", "")] = part
        elif part.tag == XS + "attributeGroup":
            found |= attributes(referred("attributeGroup", part.get("ref", "")))
        elif part.tag in (XS + "simpleContent", XS + "extension"):
            found |= attributes(part)
    return found


def children(declaration: Element) -> set[str]:
    """Return the names of the elements of a complex type or a group."""
    found: set[str] = set()
    for part in declaration:
        if part.tag == XS + "element":
            found.add((part.get("ref") or part.get("name") or "").rpartition(":")[2])
        elif part.tag == XS + "group":
            found |= children(referred("group", part.get("ref", "")))
        elif part.tag in (XS + "choice", XS + "sequence"):
            found |= children(part)
    return found


def facets(attribute: Element) -> dict[str, Any]:
    """Return the base, words and range of an attribute's type."""
    qname = attribute.get("type", "")
    if qname.startswith("xs:"):
        return {"base": qname}
    inner = attribute.find(XS + "simpleType") if not qname else referred("simpleType", qname)
    assert inner is not None
    restriction = inner.find(XS + "restriction")
    assert restriction is not None
    restrictions: dict[str, list[str]] = {}
    for facet in restriction:
        restrictions.setdefault(str(facet.tag).removeprefix(XS), []).append(facet.get("value", ""))
    return {"base": restriction.get("base"), **restrictions}


NODES: list[type[Any]] = [
    *VOCABULARY.values(),
    Block,
    Constraint,
    Description,
    Pose,
    Stance,
    Synchronize,
    Before,
    After,
    Trajectory,
    FaceInterpolator,
    Fap,
]
EACH = each_row("cls", NODES)


def declaration_of(cls: type[Any]) -> Element:
    space, name = cls.tag[1:].split("}")
    return type_of(named("element", space, name))


def assert_agrees(spec: Attribute, declared: Element) -> None:
    assert spec.required == (declared.get("use") == "required"), spec.name
    default = None if spec.required or spec.default in (None, ()) else spec.value.write(spec.default)
    assert declared.get("default") == default, spec.name
    restrictions = facets(declared)
    assert tuple(restrictions.get("enumeration", ())) == spec.value.words, spec.name
    if spec.value.type == "boolean":
        assert restrictions["base"] == "xs:boolean", spec.name
    if spec.value.low is not None:
        assert float(restrictions["minInclusive"][0]) == spec.value.low, spec.name
        assert restrictions["maxInclusive"] == [f"{spec.value.high:.15g}"], spec.name
        assert restrictions["base"] == f"xs:{spec.value.type}", spec.name


def own_attributes(cls: type[Any]) -> dict[str, Attribute]:
    """Return the attributes of a class in no namespace or its element's."""
    return {name: spec for name, spec in schema_of(cls).attributes.items() if not name.startswith("{")}


def test_xsd_of_our_namespace_is_current() -> None:
    assert schema.FILE.read_text("utf-8") == schema.render(), "run: python -m tests.schema"


def test_xsd_of_bmla_declares_attributes_of_blocks_and_behaviours_only() -> None:
    specs = {**schema_of(Block).attributes, **schema_of(Behaviour).attributes}
    wanted = {name: spec for name, spec in specs.items() if name.startswith("{")}
    assert {f"{{{BMLA}}}{e.get('name')}" for e in SCHEMAS[BMLA] if e.tag == XS + "attribute"} == set(wanted)
    for name, spec in wanted.items():
        assert_agrees(spec, named("attribute", BMLA, name.partition("}")[2]))


@EACH
def test_xsd_has_the_attributes_of_each_node(cls: type[Any]) -> None:
    declared = attributes(declaration_of(cls))
    specs = own_attributes(cls)
    points = cls.sync_points if issubclass(cls, Behaviour) else ()
    assert set(declared) == set(specs) | set(points)
    for name, spec in specs.items():
        assert_agrees(spec, declared[name])
    for point in points:
        assert declared[point].get("type") == "bml:syncReference"
        assert declared[point].get("use") is None


@EACH
def test_xsd_has_the_children_of_each_node(cls: type[Any]) -> None:
    kinds = {c.tag.partition("}")[2] for kind in schema_of(cls).children for c in kind.classes}
    declared = children(declaration_of(cls))
    if issubclass(cls, Behaviour):
        assert declared == kinds | {"description"}
    elif cls is Block:
        core = {tag.partition("}")[2] for tag in VOCABULARY if CORE in tag}
        assert declared == core | {"required", "constraint"}
    elif cls is Constraint:
        assert declared == {"synchronize", "before", "after"}
    elif cls in (Synchronize, Before, After):
        assert declared == {"sync"}
    else:
        assert declared == kinds


def test_xsd_required_takes_what_a_block_takes_but_itself() -> None:
    assert children(declaration_of(Required)) == children(declaration_of(Block)) - {"required"}


def test_xsd_sync_of_speech_is_that_of_the_node() -> None:
    text = declaration_of(SpeechText)
    assert text.get("mixed") == "true"
    sync = text.find(f"{XS}sequence/{XS}element")
    assert sync is not None
    declared = attributes(type_of(sync))
    assert set(declared) == set(schema_of(Sync).attributes)


@pytest.mark.parametrize(("part", "space"), [("faceLexeme", CORE), ("faceFacs", EXTENSIONS)])
def test_xsd_parts_of_a_face_are_behaviours_without_timing(part: str, space: str) -> None:
    declared = attributes(named("complexType", space, f"{part}Part"))
    specs = own_attributes(VOCABULARY[f"{{{space}}}{part}"])
    assert set(declared) == set(specs)
    for name, spec in specs.items():
        if name == "id":
            assert declared[name].get("use") is None
        else:
            assert_agrees(spec, declared[name])


def test_xsd_declares_no_element_outside_the_vocabulary() -> None:
    declared = {e.get("name") for root in SCHEMAS.values() for e in root if e.tag == XS + "element"}
    known = {tag.partition("}")[2] for tag in VOCABULARY}
    others = {c.tag.partition("}")[2] for c in (*NODES, Required, SpeechText)}
    assert declared == known | others


@given(blocks(foreign=False))
def test_xsd_accepts_what_is_written(block: Block) -> None:
    text = write(block)
    assert SCHEMA.validate(etree.fromstring(text.encode())), (SCHEMA.error_log, text)


@pytest.mark.parametrize("change", ['amount="7"', 'lexeme=""', 'start="nod"', 'odd="1"', 'repetition="0"'])
def test_xsd_refuses_what_the_parser_refuses(change: str) -> None:
    name = change.partition("=")[0]
    given_ = {"lexeme": 'lexeme="NOD"', name: change}
    text = f'<bml xmlns="{CORE}" id="b"><head id="h" {" ".join(given_.values())}/></bml>'
    assert not SCHEMA.validate(etree.fromstring(text))


@pytest.mark.parametrize(
    ("on_block", "inside"),
    [
        ('bmla:preplan="maybe"', ""),
        ('bmla:appendAfter="a:b"', ""),
        ("", '<head id="h" lexeme="NOD" bmla:priority="high"/>'),
        ("", '<bmla:interrupt id="i"/>'),
        ("", '<bmla:interrupt id="i" target="b" include="a:b"/>'),
        ("", '<bmla:parametervaluechange id="p" target="b1" paramId="volume"/>'),
        ("", '<bmlt:facekeyframe id="k" type="OTHER"/>'),
        ("", '<realizer:emotion id="e" activation="9"/>'),
        ("", '<realizer:faps id="f"><realizer:fap number="1" value="0"/></realizer:faps>'),
    ],
)
def test_xsd_of_extensions_refuses_what_the_parser_refuses(on_block: str, inside: str) -> None:
    spaces = " ".join(f'xmlns:{prefix}="{uri}"' for prefix, uri in PREFIXES.items())
    text = f'<bml xmlns="{CORE}" {spaces} id="b" {on_block}>{inside}</bml>'
    assert not SCHEMA.validate(etree.fromstring(text))
    assert parse(text).problems
