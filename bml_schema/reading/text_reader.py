"""The reader of the content of <text>: words, syncs, and SSML, of which it keeps the words and marks."""

from collections.abc import Iterator
from typing import Any, Protocol

from lxml import etree

from bml_schema.behaviours import Speech
from bml_schema.errors import CUSTOM_ATTRIBUTE_NOT_SUPPORTED, Fault, quoted
from bml_schema.node_schema import NodeSchema, local
from bml_schema.reading.ssml import flat, mark_of
from bml_schema.values import is_name, name


class Reader(Protocol):
    """What is used of an `element_reader.ElementReader`."""

    lenient: bool
    remarks: list[Fault]

    def tag(self, element: etree._Element) -> str: ...

    def node(self, cls: type[Any], element: etree._Element) -> Any: ...


def read_mixed(reader: Reader, schema: NodeSchema, element: etree._Element) -> Iterator[Any]:
    """Read text := (characters | sync | ssml)*, with whitespace as written.

    Raises:
        Fault: strict BML has something else than words and valid syncs.
    """
    other = next((child for child in element if reader.tag(child) not in schema.by_tag), None)
    if other is not None and not reader.lenient:
        raise Fault(f"wanted text and {schema.listed}, got <{local(str(other.tag))}>", other)
    ((_, sync),) = schema.by_tag.values()
    text, apart, seen = "", False, set(Speech.sync_points)
    for part in flat(element):
        if part is None:
            apart = bool(text) and not text[-1].isspace()
        elif isinstance(part, str):
            text += " " + part if apart and part and not part[0].isspace() else part
            apart = apart and not part
        elif (node := _sync(reader, sync, part, seen)) is not None:
            if text:
                yield text
            yield node
            text = ""
    if text:
        yield text


def _sync(reader: Reader, cls: type[Any], element: etree._Element, seen: set[str]) -> Any:
    """Return the sync of an element, or None; what is wrong is a remark, or in strict BML a Fault."""
    id, fault, node = mark_of(element), "", None
    if id == "bml":
        fault = 'id: "bml" means the block in references, so this <sync> does nothing'
    elif not is_name(id):
        fault = f"id: wanted {name.wanted}, got {quoted(id) if id else 'none'}"
    elif id in seen:
        fault = f"sync: wanted an id of its own, got {quoted(id)} again"
    else:
        node = cls(id=id)
        try:
            node = reader.node(cls, element) if reader.tag(element) == cls.tag else node
        except Fault as error:  # without its reference, it is at its place
            fault = error.text
    if fault:
        if not reader.lenient and id != "bml":
            raise Fault(fault, element)
        reader.remarks.append(Fault(fault, element, CUSTOM_ATTRIBUTE_NOT_SUPPORTED))
    if node is not None:
        seen.add(id)
    return node
