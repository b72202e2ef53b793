"""Reading and writing of XML: a parser for untrusted text, and the canonical text of an element."""

from typing import Any, cast

from lxml import etree

from bml_schema.errors import Fault
from bml_schema.escape import escape, escape_value
from bml_schema.nodes import XML


def xml_parser(**options: Any) -> etree.XMLParser:
    """Return a parser that resolves no entities, opens no files and leaves comments out.

    Args:
        options: further options of lxml's parser, such as `recover`.
    """
    return etree.XMLParser(
        resolve_entities=False,
        load_dtd=False,
        no_network=True,
        dtd_validation=False,
        huge_tree=False,
        remove_comments=True,
        remove_pis=True,
        encoding="utf-8",
        **options,
    )


def canonical(element: etree._Element) -> str:
    """Return the XML text of an element without its tail, independent of the prefixes in the document.

    Elements use default namespaces, attributes prefixes p1, p2 ...; lxml's own canonical form is quadratic
    in the number of namespaces around the element.
    """
    out: list[str] = []
    _append(element, "", out)
    return "".join(out)


def _append(element: etree._Element, default: str, out: list[str]) -> None:
    space, name = _split(str(element.tag))
    out.append(f"<{name}")
    if space != default:
        out.append(f' xmlns="{escape_value(space)}"')
    prefixes: dict[str, str] = {}
    for key, value in attributes(element):
        namespace, label = _split(key)
        if namespace == XML:
            label = f"xml:{label}"
        elif namespace:
            prefix = prefixes.get(namespace)
            if prefix is None:
                prefix = prefixes[namespace] = f"p{len(prefixes) + 1}"
                out.append(f' xmlns:{prefix}="{escape_value(namespace)}"')
            label = f"{prefix}:{label}"
        out.append(f' {label}="{escape_value(value)}"')
    if not len(element) and not element.text:
        out.append("/>")
        return
    out.append(">")
    out.append(escape(element.text or ""))
    for child in element:
        _append(child, space, out)
        out.append(escape(child.tail or ""))
    out.append(f"</{name}>")


def _split(clark: str) -> tuple[str, str]:
    space, _, name = clark.rpartition("}")
    return space[1:], name


MAX_ATTRIBUTES = 100  # of one element; BML has ten, and the time lxml takes is quadratic


def attributes(element: etree._Element) -> list[tuple[str, str]]:
    """Return Clark names and values in document order; raise Fault if there are too many for lxml."""
    count = len(element.attrib)
    if count > MAX_ATTRIBUTES:
        raise Fault(f"wanted at most {MAX_ATTRIBUTES} attributes, got {count}", element)
    items: Any = element.items()
    return cast("list[tuple[str, str]]", items)
