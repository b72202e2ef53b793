"""Documents whose only fault is that they do not declare the prefixes of some names."""

from collections.abc import Iterator, Mapping
from typing import Any

from lxml import etree

from bml_schema.canonical import MAX_ATTRIBUTES, xml_parser
from bml_schema.node_schema import local, schema_of
from bml_schema.nodes import NAMESPACES, Behaviour, Block, bmla, bmlt, core, extension, own
from bml_schema.reading.element_reader import INNER

SMARTBODY = "http://ict.usc.edu"
GRETA = "gretaNameSpace"
# The namespaces that documents mean by these prefixes.
_MEANT = NAMESPACES | {"sbm": SMARTBODY, "greta": GRETA}
_INNER = {local(tag) for tag in INNER}


def _is_spoken(element: etree._Element) -> bool:
    """Return whether an element is inside of what is spoken."""
    return any(local(str(around.tag)) in ("text", "speak") for around in element.iterancestors())


def read_undeclared(
    data: bytes, vocabulary: Mapping[str, type[Behaviour]]
) -> tuple[etree._Element, str] | None:
    """Return the root of a document without its undeclared prefixes, and how its names were read, or "".

    A name with a well-known prefix is read in that prefix's namespace, any other as if it had no prefix. What
    has no meaning either way is removed, except behaviours, which stay unknown.

    Args:
        data: the document in UTF-8 without prolog; not well-formed.
        vocabulary: Clark tag -> node class.

    Returns:
        None if the document has another fault.
    """
    parser = xml_parser(recover=True)
    root: Any = etree.fromstring(data, parser)
    undefined = etree.ErrorTypes.NS_ERR_UNDEFINED_NAMESPACE
    if (
        root is None
        or any(entry.type != undefined for entry in parser.error_log)
        or any(len(element.attrib) > MAX_ATTRIBUTES for element in root.iter())
    ):
        return None
    prefixes: dict[str, None] = {}
    removed: dict[str, None] = {}
    for element in list(root.iter()):
        prefix, colon, name = element.tag.rpartition(":")
        if colon and not prefix.startswith("{"):
            tag = next((t for t in _tags(prefix, name) if t in vocabulary or t == Block.tag), None)
            if tag is None and (prefix in _MEANT or element is root):
                tag = f"{{{_MEANT[prefix]}}}{name}" if prefix in _MEANT else name
            if tag is None and (
                _is_spoken(element)  # SSML, or unknown: its words are spoken
                or name in _INNER
                or any(name in schema_of(c).by_local for c in vocabulary.values())
            ):
                tag = name
            if tag is None and local(element.getparent().tag) in ("bml", "required"):
                element.tag = name  # an unknown behaviour, of which its own warning says so
                continue
            prefixes[prefix] = None
            if tag is None:
                removed[f"<{prefix}:{name}>"] = None
                remove_element(element)
                continue
            element.tag = tag
        if any(":" in key and key[0] != "{" for key in element.attrib):
            _rename_attributes(element, vocabulary.get(element.tag), prefixes, removed)
    if not prefixes:
        return root, ""
    note = f"prefixes without a declaration: {', '.join(prefixes)}; names with them are read as known names"
    return root, f"{note}, and without a meaning are {', '.join(removed)}" if removed else note


def _tags(prefix: str, name: str) -> Iterator[str]:
    if prefix in _MEANT:
        yield f"{{{_MEANT[prefix]}}}{name}"
    yield from (namespace(name) for namespace in (core, extension, bmla, bmlt, own))


def _rename_attributes(
    element: Any, cls: type[Behaviour] | None, prefixes: dict[str, None], removed: dict[str, None]
) -> None:
    """Give attributes with an undeclared prefix the name that is meant, or remove them."""
    node = Block if local(element.tag) == "bml" else cls
    known = {*schema_of(node).attributes, *schema_of(node).sync_points} if node else set()
    items = element.items()
    element.attrib.clear()
    for key, value in items:
        prefix, colon, name = key.rpartition(":")
        if not colon or key[0] == "{":
            element.set(key, value)
            continue
        prefixes[prefix] = None
        meant = f"{{{_MEANT[prefix]}}}{name}" if prefix in _MEANT else ""
        if meant in known or (meant and name not in known):
            element.set(meant, value)
        elif name in known and not any(name == other for other, _ in items):
            element.set(name, value)
        else:
            removed[key] = None


def remove_element(element: Any) -> None:
    """Remove an element from its parent, but not the text after it."""
    parent, before = element.getparent(), element.getprevious()
    if element.tail and before is not None:
        before.tail = (before.tail or "") + element.tail
    elif element.tail:
        parent.text = (parent.text or "") + element.tail
    parent.remove(element)
