"""Advice on expressions that are unusual for people (Wojdel 2005, 6.5)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from bml_schema import Block, Speech
from realizer.knowledge.placement_rules import place_expressions
from realizer.knowledge.sentences import Sentence, sentences
from realizer.knowledge.word_languages import ENGLISH, Words, language_of
from realizer.tables.emotional_words import WordList
from realizer.tables.knowledge import CompanionRule, Mood, PlacementRule, Role, knowledge
from realizer.tables.templates import templates

NEAR = 1.0  # s; largest distance of expressions "in the neighbourhood" (6.3.3)
FRAME = 0.04  # s; the observed durations have this resolution
MIN_COUNT = 3  # least number of expressions that have a pace
MAX_RATIO = 2.0  # between a usual distance of expressions and the present one


@dataclass(frozen=True, slots=True)
class VisibleExpression:
    """A template that a behaviour shows, visible from `start` to `end` seconds."""

    id: str
    template: str
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class Advice:
    """Advice on an unusual expression."""

    id: str  # behaviour that it is about; "" for the whole block
    text: str  # description of what is unusual
    hint: str  # what would be usual, with the source
    is_impossible: bool = False  # whether it was never observed, and not only rarely


def advise(
    block: Block,
    seen: Sequence[VisibleExpression],
    words: Mapping[str, Sequence[tuple[int, float]]],
    role: Role = "speaker",
    mood: Mood | None = None,
    lists: Words = ENGLISH,
) -> Iterator[Advice]:
    """Yield advice on the templates of a block.

    Args:
        seen: the scheduled templates.
        words: speech id -> (characters before it in the text, seconds) of each word.
        role, mood: role and mood of the character.
        lists: emotional words, and the default language.
    """
    seen = sorted(seen, key=lambda one: one.start)
    for one in seen:
        yield from _duration(one, mood)
        yield from _distance(one, seen)
        for company in knowledge().companies:
            if company.of == one.template and (company.keep or company.offered):
                yield from _companion(one, company, seen)
    if role == "speaker":
        for node in block.behaviours:
            if isinstance(node, Speech) and node.text is not None:
                language = language_of(node, block, lists.language)
                text = sentences(str(node.text), language)
                yield from _missing_expressions(
                    node.id, text, seen, dict(words.get(node.id, ())), lists.of(language)
                )
    else:
        yield from _listening(seen)
    yield from _pace(seen, role, mood)


def _duration(one: VisibleExpression, mood: Mood | None) -> Iterator[Advice]:
    """Yield advice on a duration that was never or rarely observed, considering the mood."""
    if (template := templates().get(one.template.upper())) is None:
        return  # an expression of the user's that is named like a template
    source = "Wojdel 2005, table 6.15"
    lasts, probable = one.end - one.start, template.probable
    if probable is not None:
        # The mean of some templates is longer than their probable durations, and not unusual either.
        usual = mood.length if mood is not None else 1.0
        most = max(probable[1], template.evident + FRAME) * max(usual, 1.0)
        if probable[0] * min(usual, 1.0) <= lasts <= most:
            probable = None
    yield from duration_advice(one.id, one.template, lasts, template.possible, probable, source)


def duration_advice(
    id: str,
    name: str,
    lasts: float,
    possible: tuple[float, float] | None,
    probable: tuple[float, float] | None,
    source: str,
) -> Iterator[Advice]:
    """Yield advice on an expression that is visible for a time that was never or rarely observed.

    Args:
        id: behaviour or entry that shows it, for `lasts` seconds.
        possible, probable: least and most seconds, and the source of these times; None if unknown.
    """
    if possible is not None and not possible[0] - 1e-3 <= lasts <= possible[1] + 1e-3:
        how = "short" if lasts < possible[0] else "long"
        text = f"{name} is visible for {lasts:.2g} s; it was never observed so {how}"
        yield Advice(id, text, f"it lasts {_range(possible)} ({source})", True)
    elif probable is not None and not probable[0] - 1e-3 <= lasts <= probable[1] + 1e-3:
        how = "short" if lasts < probable[0] else "long"
        text = f"{name} is visible for {lasts:.2g} s, which is unusually {how}"
        yield Advice(id, text, f"it mostly lasts {_range(probable)} ({source})")


def _range(seconds: tuple[float, float]) -> str:
    low, high = seconds
    return f"{low:g} to {high:g} s" if high < float("inf") else f"{low:g} s or longer"


def _distance(one: VisibleExpression, seen: Sequence[VisibleExpression]) -> Iterator[Advice]:
    room = knowledge().apart.get(one.template)
    if room is None:
        return
    for other in seen:
        if other is not one and other.start <= one.start and one.start - other.end < room:
            after = max(one.start - other.end, 0.0)
            text = f"{one.template} begins {after:.2g} s after {other.template} ({other.id})"
            hint = f"{one.template} does not follow another expression within {room:g} s (Wojdel 2005, 6.5)"
            yield Advice(one.id, text, hint)
            return


def _companion(
    one: VisibleExpression, company: CompanionRule, seen: Sequence[VisibleExpression]
) -> Iterator[Advice]:
    if stands_alone(one, company, seen):
        adds = "" if company.offered else "; `realizer enrich` adds what is missing"
        yield Advice(one.id, f"{one.template} stands alone", company.says + adds)


def stands_alone(one: VisibleExpression, company: CompanionRule, seen: Sequence[VisibleExpression]) -> bool:
    """Return whether an expression is without its company."""
    others = seen if company.offered else [other for other in seen if other.template == company.other]
    return not any(o is not one and o.start - NEAR < one.end and one.start < o.end + NEAR for o in others)


def _missing_expressions(
    id: str,
    text: Sequence[Sentence],
    seen: Sequence[VisibleExpression],
    times: dict[int, float],
    words: WordList | None,
) -> Iterator[Advice]:
    """Yield advice on words that usually come with an expression."""
    for placement in place_expressions(text, knowledge(), "speaker", None, words):
        at = times.get(placement.word.place)
        if not placement.rule.keep or at is None:
            continue
        missing = [name for name in placement.rule.show if not _is_visible(name, at, seen)]
        if missing:
            word = placement.word.text
            yield Advice(id, f'"{word}" is said without {", ".join(missing)}', placement.rule.says)


def _is_visible(name: str, at: float, seen: Sequence[VisibleExpression]) -> bool:
    return any(one.template == name and one.start - NEAR < at < one.end + NEAR for one in seen)


def _listening(seen: Sequence[VisibleExpression]) -> Iterator[Advice]:
    rules: tuple[PlacementRule, ...] = knowledge().placings["listener"]
    offered = list(dict.fromkeys(name for rule in rules for name in rule.show))
    companions = {c.other for c in knowledge().companies if c.of in offered}
    for one in seen:
        if one.template not in offered and one.template not in companions:
            hint = f"listeners rather show {', '.join(offered)} (Wojdel 2005, 6.5)"
            yield Advice(one.id, f"a listener shows {one.template}", hint)


def _pace(seen: Sequence[VisibleExpression], role: Role, mood: Mood | None) -> Iterator[Advice]:
    """Yield advice on expressions that are too frequent for a listener, or unusually frequent for a mood."""
    groups = _groups(seen)
    if len(groups) < MIN_COUNT:
        return
    gaps = [max(b[0] - a[1], 0.0) for a, b in pairwise(groups)]
    distance = sum(gaps) / len(gaps)
    text = f"{len(groups)} expressions, {distance:.2g} s between two of them on average"
    least = knowledge().listener_distance
    if role == "listener":
        if distance < least / MAX_RATIO:
            hint = f"a listener's face is calmer: about {least:g} s between two (Wojdel 2005, 6.5)"
            yield Advice("", f"a listener with {text}", hint)
    elif mood is not None:
        often = distance < mood.distance / MAX_RATIO
        if often or distance > mood.distance * MAX_RATIO:
            hint = f"in that mood people show one about every {mood.distance:g} s (Wojdel 2005, table 6.5)"
            yield Advice("", f"{text}: {'often' if often else 'rarely'} for the mood {mood.name!r}", hint)


def _groups(seen: Sequence[VisibleExpression]) -> list[tuple[float, float]]:
    """Return the spans of expressions; overlapping ones are joined."""
    groups: list[tuple[float, float]] = []
    for one in seen:
        if groups and one.start < groups[-1][1]:
            groups[-1] = (groups[-1][0], max(groups[-1][1], one.end))
        else:
            groups.append((one.start, one.end))
    return groups
