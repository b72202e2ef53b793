"""Hypothesis strategies: whole valid blocks, as a parser could have read them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from hypothesis import strategies as st

from bml_schema import (
    BMLA,
    BMLT,
    VOCABULARY,
    After,
    Before,
    Behaviour,
    Block,
    Constraint,
    Description,
    Emotion,
    Mood,
    Required,
    Speech,
    SpeechText,
    Sync,
    Synchronize,
    SyncRef,
    Value,
)
from bml_schema.node_schema import schema_of, sync_ref

__all__ = ["attribute_values", "blocks", "descriptions", "names", "numbers", "xml_text"]

_LETTERS = "abcxyzABCXYZ0123456789_.-+éß中"
# Everything XML 1.0 can hold, with many characters that need escapes.
_CHARACTERS = st.one_of(
    st.sampled_from(" \t\n\r<>&\"'\u0085\u2028é中😀ab"),
    st.characters(exclude_categories=["Cs", "Cc"], exclude_characters="\ufffe\uffff"),
)

# No commas: names in lists have none.
names = st.text(_LETTERS, min_size=1, max_size=8).filter(lambda n: n != "bml" and n == n.strip())
numbers = st.one_of(
    st.floats(-86400, 86400, allow_nan=False),
    st.sampled_from([0.0, 0.5, 1.0, 1e-7, -1e-300, 5e-324, 86400.0, 0.1 + 0.2]),
)


def xml_text(min_size: int = 0, max_size: int = 12) -> st.SearchStrategy[str]:
    """Return a strategy for any characters an XML document can hold."""
    return st.text(_CHARACTERS, min_size=min_size, max_size=max_size)


def attribute_values(value: Value) -> st.SearchStrategy[Any]:
    """Return a strategy for the values of an attribute."""
    if value.words:
        return st.sampled_from(value.words)
    if value.low is not None and value.high is not None:
        if value.type == "integer":
            return st.integers(int(value.low), int(value.high))
        return st.floats(value.low, value.high, allow_nan=False)
    if value.type == "boolean":
        return st.booleans()
    if value.type == "name":
        return names
    if value.type in ("names", "blockNames"):
        return st.lists(names, max_size=3, unique=True).map(tuple)
    if value.type == "behaviourName":
        return st.tuples(names, names)
    return xml_text(1).map(str.strip).filter(bool)


@st.composite
def descriptions(draw: st.DrawFn) -> Description:
    """Draw SSML, or any well-formed content in canonical form."""
    words = draw(st.text("abc é", max_size=5))
    content = draw(
        st.sampled_from(
            [
                words,
                f"<a>{words}x</a>",
                f'<a xmlns="urn:x"><b q="1"/>{words}<c xmlns=""/></a>{words}',
                f'<a xmlns:p1="urn:y" p1:b="&lt;" xml:lang="de"/>{words}',
                f'<a xmlns="http://www.bml-initiative.org/bml/bml-1.0">{words}x</a>',
            ]
        )
    )
    kind = draw(st.sampled_from(["application/ssml+xml", "text/x-own"]))
    if kind == "application/ssml+xml":
        content = f'<speak xmlns="http://www.w3.org/2001/10/synthesis">{words}<mark name="m"/></speak>'
    return Description(priority=draw(st.integers(-5, 5)), type=kind, content=content)


@st.composite
def _references(draw: st.DrawFn, points: Mapping[str, list[tuple[str, int | None]]]) -> SyncRef:
    offset = draw(st.one_of(st.just(0.0), numbers))
    kind = draw(st.integers(0, 5))
    if kind == 0:
        return SyncRef(offset=offset)
    if kind == 1:
        return SyncRef(behaviour="bml", sync="start", offset=offset)
    if kind == 2:
        # Names of another block are not checked, so they must not look like an offset.
        other = st.text("abc_", min_size=1, max_size=4)
        sync = draw(st.sampled_from(["start", "end", "tm1"]))
        return SyncRef(block="other block", behaviour=draw(other), sync=sync, offset=offset)
    behaviour = draw(st.sampled_from(sorted(points)))
    sync, index = draw(st.sampled_from(points[behaviour]))
    return SyncRef(behaviour=behaviour, sync=sync, index=index, offset=offset)


# Elements of other languages, in canonical form.
OTHERS = [
    '<parameter xmlns="http://hmi.ewi.utwente.nl/bmlt" name="a" value="&lt;1"/>',
    '<a xmlns="urn:x" xmlns:p1="urn:y" p1:b=""> x <b xmlns=""/>\n</a>',
]


def _own_values(draw: st.DrawFn, cls: type[Any]) -> dict[str, Any]:
    """Draw values for the plain attributes of a class, with some optional ones."""
    values: dict[str, Any] = {}
    for spec in schema_of(cls).attributes.values():
        if spec.field != "id" and spec.value is not sync_ref and (spec.required or draw(st.booleans())):
            values[spec.field] = draw(attribute_values(spec.value))
    if cls in (Emotion, Mood):
        # Named by a word, by a place on the wheel, or by valence and arousal.
        ways = [("name",), ("angle", "activation"), ("valence", "arousal")]
        way = next((way for way in ways if way[0] in values), ways[0])
        for names in ways:
            for name in names:
                if names != way:
                    values.pop(name, None)
        values = {"name": "joy"} | values if way == ("name",) else values
        if way == ("valence", "arousal"):
            values.setdefault("arousal", 0.0)
    return values


def _content(draw: st.DrawFn, cls: type[Any]) -> dict[str, Any]:
    """Draw the children and the text of a class, except mixed content, which has references."""
    shape = schema_of(cls)
    values: dict[str, Any] = {shape.text: draw(xml_text())} if shape.text else {}
    for kind in shape.children:
        if kind.classes == (SpeechText,):
            continue
        most = 3 if kind.many else 1
        chosen = draw(st.lists(st.sampled_from(kind.classes), min_size=kind.least, max_size=most))
        nodes = [_part(draw, c) for c in chosen]
        if kind.many:
            values[kind.field] = tuple(nodes)
        elif nodes:
            values[kind.field] = nodes[0]
    return values


def _part(draw: st.DrawFn, cls: type[Any]) -> Any:
    values = _own_values(draw, cls) | _content(draw, cls)
    if issubclass(cls, Behaviour):  # a part of a face, which needs no id
        values["id"] = draw(st.just("") | names)
    return cls(**values)


@st.composite
def blocks(draw: st.DrawFn, foreign: bool = True) -> Block:
    """Draw valid blocks: any behaviours, valid references, constraints, required parts.

    Args:
        foreign: also attributes and elements of other languages.
    """
    ids = draw(st.lists(names, max_size=6, unique=True))
    kinds = {id: draw(st.sampled_from(sorted(VOCABULARY.values(), key=lambda c: c.tag))) for id in ids}
    given = {id: _own_values(draw, kinds[id]) | _content(draw, kinds[id]) for id in ids}
    marks = {
        id: draw(st.lists(names.filter(lambda n: n not in ("start", "end")), max_size=3, unique=True))
        for id in ids
        if kinds[id] is Speech and draw(st.booleans())
    }
    points: dict[str, list[tuple[str, int | None]]] = {}
    for id, cls in kinds.items():
        points[id] = [(p, None) for p in (*cls.sync_points, *marks.get(id, []))]
        times = given[id].get("repetition", 1)
        if times > 1:
            points[id] += [("stroke", n) for n in range(1, min(times, 4) + 1)]
    refs = _references(points) if points else numbers.map(lambda t: SyncRef(offset=t))
    others = st.dictionaries(
        st.sampled_from(["{urn:z}z", "{urn:a}b", f"{{{BMLA}}}unheardOf", f"{{{BMLT}}}id"]),
        xml_text(),
        max_size=2,
    )
    nodes: list[Behaviour | Constraint] = []
    for id, cls in kinds.items():
        if id in marks:
            parts: list[str | Sync] = [draw(xml_text(1))]
            for mark in marks[id]:
                parts += [Sync(id=mark, ref=draw(st.none() | refs)), draw(xml_text(1))]
            given[id]["text"] = SpeechText(parts=tuple(parts))
        node = cls(
            id=id,
            syncs={p: draw(refs) for p in cls.sync_points if draw(st.integers(0, 2)) == 0},
            descriptions=tuple(draw(st.lists(descriptions(), max_size=1))),
            unknown_attributes=draw(others) if foreign else {},
            unknown_children=tuple(draw(st.lists(st.sampled_from(OTHERS), max_size=2))) if foreign else (),
            **given[id],
        )
        nodes.append(node)
    some = st.lists(refs, min_size=1, max_size=3).map(tuple)
    for n in range(draw(st.integers(0, 2))):
        part = st.one_of(
            st.builds(Synchronize, refs=some),
            st.builds(Before, ref=refs, refs=some),
            st.builds(After, ref=refs, refs=some),
        )
        id_ = draw(st.none() | st.just(f"constraint{n}"))
        nodes.append(Constraint(id=id_, parts=tuple(draw(st.lists(part, min_size=1, max_size=2)))))
    cut = draw(st.integers(0, len(nodes)))
    inside = tuple(draw(st.permutations(nodes[cut:])))
    children = (*nodes[:cut], *((Required(children=inside),) if draw(st.booleans()) else inside))
    id = draw(names)
    values = _own_values(draw, Block)
    # Its own id in a list of blocks is ignored.
    lists = {k: tuple(n for n in v if n != id) for k, v in values.items() if isinstance(v, tuple)}
    return Block(
        id=id, children=children, unknown_attributes=draw(others) if foreign else {}, **values | lists
    )
