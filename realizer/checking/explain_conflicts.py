"""Labels for the lines of a scheduling conflict; parses texts of `realizer.scheduling.conflict`."""

import re
from collections.abc import Iterable

from bml_schema.reading.tolerant_scanner import Element
from bml_schema.source import Spot
from realizer.checking.finding import FindingBuilder, Label
from realizer.scheduling.timing import Clause, Warning

_RELATION = re.compile(r"(\S+) (?:is )?(=|not before|not after) (.+)")
_CANNOT = re.compile(r".+? (?:cannot be (?:placed|kept)|was given up)")
_DANGLING = re.compile(
    r"(?:required: )?(\S.*?)(?: was dropped|:\S+ was given up)"
    r"(?: \((?:(constraint)(?: (\S+))?, )?line (\d+)\))?: (.+)"
)
_REFERENCE = re.compile(r"([^:\s]+(?: [^:\s]+)*:\S+(?: [+-] [\d.]+)?)(?=:? )")
_BECAUSE = re.compile(r"; (\S+ was dropped because .+)$|; (a constraint that .+)$|(all of this is required)$")


def explain_conflict(builder: FindingBuilder, warning: Warning, text: str) -> bool:
    """Add the explanation of a scheduling conflict and return whether the warning is about one.

    Args:
        text: text of the warning without its place.
    """
    if warning.clash:
        _conflict(builder, warning.clash, text)
        return True
    if dangling := _DANGLING.fullmatch(text):
        _dangling_reference(builder, *dangling.groups())
    return dangling is not None


def _conflict(builder: FindingBuilder, clash: Iterable[Clause], text: str) -> None:
    """Add a label for every line that takes part, and notes for other requirements."""
    builder.path = builder.path or "/bml"
    for clause in clash:
        own = _constraint(builder, clause.id.partition(":")[2], clause.line)
        of_behaviour = ":" in clause.id and (own is None or own.name.rpartition(":")[2] != "constraint")
        relation = _RELATION.fullmatch(clause.text)
        # The document has no text for the order of a behaviour's points, only for equalities.
        if relation is None or clause.line is None or (of_behaviour and relation[2] != "="):
            builder.notes.append(f"note: {clause.text}")
            continue
        left, _, right = relation.groups()
        if of_behaviour:
            spot = _in_behaviour(builder, left, clause.line)
        else:
            spot = _in_constraint(builder, own, (right, left), clause.line)
            if own is not None and clause.id == builder.id:
                builder.path = builder.source.path(own)
        builder.labels.append(Label(spot, clause.text.replace(" is ", " ", 1)))
    cannot = _CANNOT.match(text)
    builder.head = cannot[0] if cannot else "these cannot all hold"
    if reason := _BECAUSE.search(text):
        builder.notes.append(f"note: {next(filter(None, reason.groups()))}")


def _dangling_reference(
    builder: FindingBuilder,
    name: str,
    kind: str | None,
    constraint: str | None,
    place: str | None,
    message: str,
) -> None:
    """Add a label for a reference to an unknown point; arguments as in `_DANGLING`."""
    element, line = builder.element, int(place) if place else builder.line
    if element is None and kind:
        element = _constraint(builder, constraint, line)
    elif element is None:
        element = builder.source.named(name, line=line, block=builder.block)
    builder.path = builder.source.path(element) if element is not None else builder.path or "/bml"
    builder.head = message
    if element is None:
        if line is not None:
            builder.labels.append(Label(builder.source.whole_line(line), message))
        return
    found = _REFERENCE.match(message)
    wanted = "".join(found[1].split()) if found else ""
    for inner in (element, *builder.source.below(element)):
        for attribute in inner.attributes:
            if wanted and "".join(builder.source.value(inner, attribute).split()) == wanted:
                builder.labels.append(Label(builder.source.locate_in(inner, attribute), message))
                return
    builder.labels.append(Label(builder.source.name_spot(element), message))


def _in_behaviour(builder: FindingBuilder, point: str, line: int) -> Spot:
    id, _, sync = point.partition(":")
    element = builder.source.named(id, line=line, block=builder.block)
    if element is None:
        return builder.source.whole_line(line)
    if builder.source.value_span(element, sync) is None:
        for mark in builder.source.below(element):
            if builder.source.id(mark) == sync:
                return builder.source.locate_in(mark, "ref")
    return builder.source.locate_in(element, sync)


def _constraint(builder: FindingBuilder, id: str | None, line: int | None) -> Element | None:
    found = builder.source.named(id, line=line) if id else None
    if found is None and not id and line is not None:
        on = (e for e in builder.source.on_line(line) if e.name.rpartition(":")[2] == "constraint")
        found = next(on, None)
    return found


def _in_constraint(builder: FindingBuilder, found: Element | None, refs: tuple[str, ...], line: int) -> Spot:
    source = builder.source
    if found is None:
        return source.whole_line(line)
    wanted = ["".join(str(ref).split()) for ref in refs]
    for ref in wanted:
        for element in source.below(found):
            if "".join(source.value(element, "ref").split()) == ref:
                return source.locate_in(element, "ref")
    return source.name_spot(found)
