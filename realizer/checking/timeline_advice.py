"""Advice on timelines: what is unusual for people, and the expressions that usually accompany others."""

from collections.abc import Iterator
from typing import NamedTuple

from bml_schema import Block
from realizer.expressions.expression import Expression
from realizer.expressions.library import Library
from realizer.expressions.timeline import Timeline, VisibleSpan, visible_spans
from realizer.knowledge.advice import Advice, VisibleExpression, advise, duration_advice, stands_alone
from realizer.tables.knowledge import CompanionRule, Mood, Role, knowledge
from realizer.tables.templates import PREFIX

MIN_LEAD = 0.2  # s; companions that would be shorter are not offered


class Companion(NamedTuple):
    """An expression that usually accompanies an entry and is missing.

    Attributes:
        track, entry: numbers of the entry, from 0.
        expression: its name in the library.
        start, end: seconds from the start of the timeline.
        says: the rule as a sentence, with its source.
        must: whether its absence is advised against, not only noted.
    """

    track: int
    entry: int
    expression: str
    start: float
    end: float
    says: str
    must: bool


def timeline_advice(
    timeline: Timeline, library: Library, role: Role = "speaker", mood: Mood | None = None
) -> Iterator[Advice]:
    """Yield advice on the entries of a timeline without faults, by Wojdel 2005, 6.5; ids are their places."""
    seen = []
    for span in visible_spans(timeline, library):
        expression = span.expression
        if template := _template(expression):
            seen.append(VisibleExpression(span.place, template, span.begin, span.end))
            continue
        usual = expression.possible, expression.probable, str(expression.file or expression.source)
        yield from duration_advice(span.place, expression.name, span.end - span.begin, *usual)
    yield from advise(Block(id="timeline"), seen, {}, role, mood)


def missing_companions(timeline: Timeline, library: Library) -> Iterator[Companion]:
    """Yield the expressions that usually accompany those of a timeline, where they are missing."""
    spans = [span for span in visible_spans(timeline, library) if _template(span.expression)]
    seen = [VisibleExpression(s.place, _template(s.expression), s.begin, s.end) for s in spans]
    for span, one in zip(spans, seen, strict=True):
        for company in knowledge().companies:
            if company.of == one.template and stands_alone(one, company, seen):
                start, end = _times(span, company, library[PREFIX + company.other].duration)
                if end - start >= MIN_LEAD:
                    yield Companion(
                        span.track, span.entry, PREFIX + company.other, start, end, company.says, company.keep
                    )


def _times(span: VisibleSpan, company: CompanionRule, usual: float) -> tuple[float, float]:
    """Return when a companion starts and ends, as `Enricher` places it."""
    times = span.times
    lead = min(company.lead, times.start)
    if company.by == "around":
        return times.start - lead, times.end + company.lead
    if company.by == "before":
        return times.start - lead, times.reached if lead >= MIN_LEAD else times.start
    if company.by == "after":
        return times.left, times.left + usual
    return times.start, times.end


def _template(expression: Expression) -> str:
    family, _, template = expression.name.rpartition(":")
    return template if family == "template" and expression.file is None else ""
