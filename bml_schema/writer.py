"""The writer of blocks: parse(write(block)) == block."""

from collections.abc import Iterable, Mapping
from typing import Any

from lxml import etree

from bml_schema.escape import escape, escape_value
from bml_schema.node_schema import schema_of, sync_ref
from bml_schema.nodes import CORE, NAMESPACES, XML, Behaviour, Block, Constraint, Description, Required
from bml_schema.steps import next_element
from bml_schema.sync_refs import SyncRef
from bml_schema.values import decimal

_IN_CORE = f"{{{CORE}}}"
# Well-known prefixes; any other namespace becomes ns1, ns2, ...
_PREFIXES = {uri: prefix for prefix, uri in NAMESPACES.items()}
_PREFIXES["http://www.w3.org/2001/XMLSchema-instance"] = "xsi"


def write(block: Block) -> str:
    """Return the document of a block, in the core namespace, with one behaviour a line.

    Raises:
        ValueError: a node has values that XML or BML cannot represent: a control character, NaN, or a
            description or unknown child that is not well-formed.
        TypeError: `block` is no Block.
    """
    if not isinstance(block, Block):
        raise TypeError(f"block: wanted a Block, got {type(block).__name__}")
    return Writer().block(block) + "\n"


class Writer:
    """A writer of elements; collects the namespaces that the root has to declare."""

    def __init__(self) -> None:
        self.prefixes: dict[str, str] = {}

    def block(self, block: Block) -> str:
        lines = [line for child in block.children for line in self._child(child, "  ")]
        values = self._attributes(block)
        start = f'<bml xmlns="{CORE}"{self.declarations()}{values}'
        return "\n".join((start + ">", *lines, "</bml>")) if lines else start + "/>"

    def declarations(self) -> str:
        """Return xmlns attributes for every namespace used so far."""
        return "".join(f' xmlns:{p}="{escape_value(uri)}"' for uri, p in self.prefixes.items())

    def behaviour(self, node: Behaviour, indent: str = "") -> str:
        """Write one behaviour; its namespaces are in `declarations` afterwards."""
        return self._element(node, indent)

    def _child(self, node: Behaviour | Required | Constraint, indent: str) -> Iterable[str]:
        if isinstance(node, Required):
            yield f"{indent}<required>"
            for child in node.children:
                yield from self._child(child, indent + "  ")
            yield f"{indent}</required>"
        elif isinstance(node, Constraint):
            yield f"{indent}<constraint{self._attributes(node)}>"
            for part in node.parts:
                yield f"{indent}  <{self.name(part.tag)}{self._attributes(part)}>"
                yield from (f"{indent}    <sync{_value('ref', str(ref))}/>" for ref in part.refs)
                yield f"{indent}  </{self.name(part.tag)}>"
            yield f"{indent}</constraint>"
        else:
            yield self._element(node, indent)

    def _element(self, node: Any, indent: str) -> str:
        next_element()
        schema = schema_of(type(node))
        name = self.name(node.tag)
        start = f"<{name}{self._attributes(node)}"
        if schema.mixed:
            inside = "".join(
                escape(p) if isinstance(p, str) else self._element(p, "") for p in getattr(node, schema.mixed)
            )
            return f"{indent}{start}>{inside}</{name}>"
        if schema.text:
            return f"{indent}{start}>{escape(getattr(node, schema.text))}</{name}>"
        inner: list[str] = []
        for kind in schema.children:
            value = getattr(node, kind.field)
            for child in value if kind.many else filter(None, [value]):
                inner.append(self._element(child, indent + "  "))
        for description in getattr(node, "descriptions", ()):
            inner.append(f"{indent}  {self._description(description)}")
        inner += [f"{indent}  {_checked(other)}" for other in getattr(node, "unknown_children", ())]
        if not inner:
            return f"{indent}{start}/>"
        return "\n".join((f"{indent}{start}>", *inner, f"{indent}</{name}>"))

    def _description(self, node: Description) -> str:
        inside = _parsed(node.content, "description: wanted well-formed content")
        values = self._attributes(node)
        if any(not str(e.tag).startswith("{") for e in inside.iterdescendants()):
            # Elements without namespace must not get the core one.
            return f'<bml:description xmlns:bml="{CORE}" xmlns=""{values}>{node.content}</bml:description>'
        return f"<description{values}>{node.content}</description>"

    def _attributes(self, node: Any) -> str:
        schema = schema_of(type(node))
        out = ""
        for spec in schema.attributes.values():
            value = getattr(node, spec.field)
            if value is None or (value == spec.default and not spec.required):
                continue
            if value or spec.field != "id":  # the parts of a face may have no id
                text = str(value) if spec.value is sync_ref else spec.value.write(value)
                out += _value(self.name(spec.name, attribute=True), text)
        for point in _ordered(node):
            ref = node.syncs[point]
            out += f' {point}="{decimal(ref.offset)}"' if ref.behaviour is None else _value(point, str(ref))
        for name, text in getattr(node, "unknown_attributes", {}).items():
            out += _value(self.name(name, attribute=True), text)
        return out

    def name(self, clark: str, *, attribute: bool = False) -> str:
        """Return a Clark name with a prefix, which the root declares; elements of the core have no prefix."""
        if not clark.startswith("{"):
            return clark
        if not attribute and clark.startswith(_IN_CORE):
            return clark[len(_IN_CORE) :]
        space, _, local = clark[1:].rpartition("}")
        if not space:
            return local
        if space == XML:
            return f"xml:{local}"
        if space not in self.prefixes:
            self.prefixes[space] = _PREFIXES.get(space, f"ns{len(self.prefixes) + 1}")
        return f"{self.prefixes[space]}:{local}"


_PLAIN = etree.XMLParser(resolve_entities=False, no_network=True, load_dtd=False, remove_comments=True)


def _parsed(content: str, wanted: str) -> etree._Element:
    """Parse content inside a wrapper element; raise ValueError if it is not well-formed."""
    try:
        return etree.fromstring(f"<x>{content}</x>".encode(), _PLAIN)
    except (etree.XMLSyntaxError, UnicodeEncodeError) as error:
        raise ValueError(f"{wanted}, got {content[:60]!r}") from error


def _checked(other: str) -> str:
    """Return an unknown child; raise ValueError if it is not one well-formed element in a namespace."""
    wanted = "others: wanted one well-formed element in a namespace of its own"
    inside = _parsed(other, wanted)
    if len(inside) != 1 or not str(inside[0].tag).startswith("{") or inside.text or inside[0].tail:
        raise ValueError(f"{wanted}, got {other[:60]!r}")
    return other


def _value(name: str, text: str) -> str:
    return f' {name}="{escape_value(text)}"'


def _ordered(node: Any) -> list[str]:
    """Return the sync points of a node that have references, in chronological order."""
    syncs: Mapping[str, SyncRef] = getattr(node, "syncs", {})
    known = [p for p in node.sync_points if p in syncs] if syncs else []
    return known if len(known) == len(syncs) else known + [p for p in syncs if p not in known]
