"""Examples of elements: documents of the corpus, and drawings of their schedules."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

from lxml import etree

import realizer
from docs.generator.steps import drawing
from tests.cases import CASES, Case


@dataclass(frozen=True)
class Example:
    """A document that shows an element.

    Attributes:
        says: what is true of it, a sentence.
        text: the document.
    """

    says: str
    text: str


def example_of(namespace: str, name: str) -> Example | None:
    """Return the shortest document of the corpus that plays without warnings and has an element, or None."""
    tag = f"{{{namespace}}}{name}" if namespace else name
    found = [case for case in CASES if tag in tags(case)]
    if not found:
        return None
    case = min(found, key=lambda case: len(case.document))
    says = str(case.wanted["says"])
    return Example(says[:1].upper() + says[1:] + ".", case.document.decode("utf-8"))


@cache
def tags(case: Case) -> frozenset[str]:
    """Return the elements of a document of the corpus that plays whole; none if it does not."""
    if case.is_bytes or case.wanted.get("refused") or case.wanted.get("warnings") or len(case.messages) != 1:
        return frozenset()
    try:
        root = etree.fromstring(case.document)
    except etree.XMLSyntaxError:
        return frozenset()
    return frozenset(str(element.tag) for element in root.iter(etree.Element))


def plot(example: Example) -> str | None:
    """Return the drawing of an example's schedule, or None if it has no behaviours."""
    played = realizer.realize(example.text, voice="silent", idle=False)
    if not any(schedule.behaviours for schedule in played.schedules):
        return None
    return drawing(played)
