"""Problems and hints for attributes that an element's class does not define.

A slip such as `amout="1"` would otherwise show nothing, and nobody would know why. What other languages put
on our elements is theirs: it is kept, and nothing is said.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from lxml import etree

from bml_schema.node_schema import NodeSchema, local
from bml_schema.nodes import CORE, EXTENSIONS, OWN

# BMLA and BMLT have more attributes than are known here.
_OURS = tuple(f"{{{space}}}" for space in (CORE, EXTENSIONS, OWN))


def describe_unknown(
    shape: NodeSchema,
    element: etree._Element,
    names: Iterable[str],
    timed: bool,
    suggest: Callable[[str, Iterable[str]], str],
) -> str:
    """One text for all attributes that mean nothing where they stand; "" where there are none such.

    Args:
        names: Clark names of what the shape does not know.
        timed: sync points are attributes of the element.
        suggest: (a name, those known) -> `, did you mean ...?` or "".
    """
    wrong = [name for name in names if name not in shape.old and (name[0] != "{" or name.startswith(_OURS))]
    if not wrong:
        return ""
    known = [name for name in shape.attributes if name[0] != "{"]
    if timed:
        known += shape.sync_points
    around = element.getparent() if shape.timed and not timed else None
    where = "" if around is None else f" inside <{local(str(around.tag))}>"
    said = [f"{name}: no attribute of <{shape.name}>{where}, so it does nothing" for name in wrong]
    # Once, before the last hint: what is meant by several is in one list.
    said[-1] += f"; known are {', '.join(known)}" if known else "; there are none"
    return "; ".join(text + suggest(local(name), known) for text, name in zip(said, wrong, strict=True))
