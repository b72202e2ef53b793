"""Heads and faces of Greta that a description names, as in `<reference>head=head_nod</reference>`."""

from collections.abc import Callable
from typing import Any

from lxml import etree

from bml_schema.dialects.table import Row, table

__all__ = ["translate_reference"]

_WORDS = frozenset(("lexeme", "type", "rotation", "orientation", "au", "shape"))
_PARTS = ("{*}lexeme", "{*}faceLexeme", "{*}facs", "{*}faceFacs")


def translate_reference(element: Any, name: str, apply: Callable[[Row], None]) -> None:
    """Give a head or face without a lexeme the one that its description refers to.

    Args:
        element: the behaviour.
        name: its local name.
        apply: called with the row of the table that was used.
    """
    if name not in ("head", "face") or not _WORDS.isdisjoint(element.keys()):
        return
    row = next(row for row in table().attributes["description"]["type"] if row.dialect == "Greta")
    for description in element.findall("{*}description"):
        reference = description.findtext("{*}reference", "").rpartition("=")[2].strip()
        if not reference or not row.fits(description.get("type", "")):
            continue
        if name == "head":
            element.set("lexeme", reference)
            apply(row)
        elif all(element.find(part) is None for part in _PARTS):
            space = str(element.tag).rpartition("}")[0]
            etree.SubElement(element, f"{space}}}lexeme" if space else "lexeme", lexeme=reference)
            apply(row)
