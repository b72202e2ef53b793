"""Faults that are hidden by other faults, found by parsing again without those."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence

from bml_schema import Block, BMLError, Problem, read
from bml_schema.source import Source
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import VOCABULARY
from realizer.checking.explain import attributes_of
from realizer.playback.player import Player
from realizer.scheduling.timing import Warning


def located_warning(block: Block, id: str, type: str, text: str) -> Warning:
    """Return a warning about a behaviour, with its place."""
    place = block.places.get(id)
    return Warning(f"{block.id}:{id}", type, text if place is None else place.with_place(text))


def without_faults(source: Source, items: Sequence[Block | BMLError]) -> list[Block | None]:
    """Parse a text again without the attributes for which behaviours were dropped.

    Args:
        items: the results of parsing the text.

    Returns:
        A block for each item, or None if there is nothing more to find.
    """
    problems = [p for item in items if isinstance(item, Block) for p in item.problems if p.dropped]
    spans = sorted(set(_spans(source, problems)))
    if not spans:
        return [None] * len(items)
    # Blanks keep the positions of the rest.
    parts, last = [], 0
    for start, end in spans:
        parts += [source.text[last:start], re.sub(r"[^\n]", " ", source.text[start:end])]
        last = end
    again = list(read("".join(parts) + source.text[last:], VOCABULARY))
    if len(again) != len(items):
        return [None] * len(items)
    return [item if isinstance(item, Block) else None for item in again]


def masked_faults(block: Block, whole: Block, player: Player, context: PlanningContext) -> Iterator[Warning]:
    """Yield the faults of behaviours that had been dropped from a block.

    Args:
        whole: the block from `without_faults`.
    """
    known = {node.id for node in block.behaviours}
    for node in whole.behaviours:
        kind = player.kinds.get(node.tag)
        if node.id not in known and kind is not None:
            for fault in kind.check(node, context):
                yield located_warning(whole, node.id, fault.type, fault.text)


def _spans(source: Source, problems: Iterable[Problem]) -> Iterator[tuple[int, int]]:
    """Yield the spans of attributes that problems mention, from the name to the closing quote."""
    for problem in problems:
        element = source.find(problem.path, line=problem.line, block=problem.id.partition(":")[0])
        if element is None:
            continue
        for name in attributes_of(problem.text):
            span = source.value_span(element, name)
            if span is None or name == "id":
                continue  # behaviours need an id
            tag = source.text[element.offset : span[0]]
            begun = re.search(r"[^\s\"'<>/=]+\s*=\s*[\"']$", tag)
            if begun is not None:
                yield element.offset + begun.start(), span[1] + 1
