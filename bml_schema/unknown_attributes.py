"""Messages about attributes that an element's class does not define.

A misspelling such as `amout="1"` would otherwise go unnoticed. Attributes of other namespaces are kept
without a message.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from lxml import etree

from bml_schema.node_schema import NodeSchema, local
from bml_schema.nodes import CORE, EXTENSIONS, OWN

# Not BMLA and BMLT: they have more attributes than this package knows.
_OURS = tuple(f"{{{space}}}" for space in (CORE, EXTENSIONS, OWN))


def describe_unknown(
    shape: NodeSchema,
    element: etree._Element,
    names: Iterable[str],
    timed: bool,
    suggest: Callable[[str, Iterable[str]], str],
) -> str:
    """Return one message about all attributes without a meaning, or "".

    Args:
        names: Clark names of attributes that the schema does not have.
        timed: sync points are attributes of the element.
        suggest: (name, known names) -> `, did you mean ...?` or "".
    """
    wrong = [name for name in names if name not in shape.old and (name[0] != "{" or name.startswith(_OURS))]
    if not wrong:
        return ""
    known = [name for name in shape.attributes if name[0] != "{"]
    if timed:
        known += shape.sync_points
    around = element.getparent() if shape.timed and not timed else None
    where = "" if around is None else f" inside <{local(str(around.tag))}>"
    texts = [f"{name}: no attribute of <{shape.name}>{where}, so it does nothing" for name in wrong]
    # The list of known attributes comes once, before the last suggestion.
    texts[-1] += f"; known are {', '.join(known)}" if known else "; there are none"
    return "; ".join(text + suggest(local(name), known) for text, name in zip(texts, wrong, strict=True))
