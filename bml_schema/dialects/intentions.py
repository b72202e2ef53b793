"""Greta's FML: what a speaker means becomes what a face shows, by a table (`fml.csv`).

Columns: element and type, a pattern, of FML; and what is shown: behaviours with their attributes, or - for
nothing. Amounts and intensities are those of the importance 1.
"""

import csv
import re
from collections.abc import Callable, Iterator
from functools import cache
from itertools import chain, count
from pathlib import Path
from typing import Any

from lxml import etree

from bml_schema.canonical import xml_parser
from bml_schema.dialects.table import Row
from bml_schema.node_schema import local
from bml_schema.nodes import own
from bml_schema.values import NUMBER, decimal

FILE = Path(__file__).with_name("fml.csv")
_SCALED = ("amount", "intensity")
_POINTS = ("start", "end")
_HIDDEN = ("inhibit", "inhibited", "masked", "mask")  # emotions that are felt and not shown
FML_WRAPPER = "fml-apml"  # the element around <bml> and <fml>
_FML = re.compile(r"<fml(?=[\s>]).*?</fml\s*>", re.DOTALL)


def fml_of(text: str) -> Any:
    """Return the <fml> of a text, as much of it as can be read, or None."""
    found = _FML.search(text)
    return None if found is None else etree.fromstring(found[0].encode(), xml_parser(recover=True))


@cache
def intentions() -> tuple[Row, ...]:
    """Return the rows of the table, as of a dialect: `value` has the type."""
    lines = [line for line in FILE.read_text("utf-8").splitlines() if not line.startswith("#")]
    return tuple(
        Row("Greta", element, "type", type, shown, "") for element, type, shown in csv.reader(lines[1:])
    )


def show_intentions(root: Any, fml: Any, used: set[str], apply: Callable[[Row], None]) -> None:
    """Append to a <bml> what its <fml> wants shown; `apply` is called with what was read as what.

    Args:
        used: the ids of the document, to which those of the new behaviours are added.
    """
    space = "".join(str(root.tag).rpartition("}")[:2])
    numbers: dict[str, Iterator[int]] = {}
    for intention in fml:
        name, type = local(str(intention.tag)), (intention.get("type") or "").strip()
        row = next((row for row in intentions() if row.element == name and row.fits(type)), None)
        hidden = row is None or not (type or row.value == "*") or intention.get("regulation", "") in _HIDDEN
        becomes = "-" if row is None or hidden else row.becomes.replace("{type}", type)
        apply(Row("Greta", name, "type" if type else "", type, becomes.replace(";", ", "), ""))
        times = {point: time for point in _POINTS if (time := intention.get(point, "").strip())}
        for point, time in list(times.items()):
            if ":" in time and time.partition(":")[0].strip() not in used:
                apply(Row("Greta", name, point, times.pop(point), "-", ""))
        ids = _ids(intention.get("id", "").strip() or name, used, numbers)
        for shown in becomes.split(";") if becomes != "-" else ():
            tag, *attributes = shown.split()
            element = etree.SubElement(root, own(tag) if tag == "emotion" else f"{space}{tag}")
            element.sourceline = intention.sourceline
            element.set("id", next(ids))
            for attribute in attributes:
                key, _, value = attribute.partition("=")
                element.set(key, _scaled(value, intention) if key in _SCALED else value)
            for point, time in times.items():
                if tag != "head" or point == "start":  # a movement of the head lasts as long as it does
                    element.set(point, time)


def _scaled(value: str, intention: Any) -> str:
    importance = (intention.get("importance") or intention.get("intensity") or "1").strip()
    factor = float(importance) if NUMBER.fullmatch(importance) and len(importance) < 40 else 1.0
    return decimal(round(float(value) * min(max(factor, 0.0), 1.0), 4))


def _ids(id: str, used: set[str], numbers: dict[str, Iterator[int]]) -> Iterator[str]:
    """Yield ids that no other behaviour has: the id itself, then with numbers."""
    id = "".join("-" if c in ": " else c for c in id)
    for candidate in chain((id,), (f"{id}-{n}" for n in numbers.setdefault(id, count(2)))):
        if candidate not in used:
            used.add(candidate)
            yield candidate
