"""Explanation of conflicts: which part is dropped, and why, in words."""

from __future__ import annotations

from collections.abc import Collection, Sequence

from realizer.scheduling.conflict import Conflict, LengthBound
from realizer.scheduling.problem import Part, Relation
from realizer.scheduling.timing import Clause, Warning

IMPOSSIBLE = "IMPOSSIBLE_TO_SCHEDULE"
# In a sentence; `Warning.clash` has all.
MAX_CLAUSES = 30


def choose(clash: Conflict) -> Part | None:
    """Return the part to drop: an optional constraint before any behaviour, then the lowest priority.

    Of equal ones it is the later in the document. A behaviour that is only referred to stays if another one
    states a relation or gap. Return None if everything is required.
    """
    return max(_candidates(clash), key=lambda part: (-part.priority, part.order), default=None)


def warning_of(clash: Conflict, dropped: Part) -> Warning:
    """Return the warning about a dropped part."""
    name = dropped.name or "a constraint"
    if dropped.is_constraint:
        name = f"constraint {dropped.name}" if dropped.name else "a constraint without an id"
        text = f"{name} cannot be kept: {in_words(clash)}; a constraint that is not required gives way first"
    else:
        reason = _reason(clash, dropped)
        text = f"{name} cannot be placed: {in_words(clash)}; {name} was dropped because {reason}"
    return Warning(dropped.id, IMPOSSIBLE, text, clauses(clash), dropped.is_constraint)


def refusal(block: str, clash: Conflict) -> Warning:
    """Return the warning about a block in which all parts of a conflict are required."""
    text = f"{in_words(clash)}, and all of this is required"
    return Warning(block, IMPOSSIBLE, text, clauses(clash))


def fault_warning(part: Part, text: str) -> Warning:
    """Return the warning for a reference to something that does not exist."""
    name = part.name or "a constraint"
    said = f"{name} was dropped{_placed(part, part.line)}: {text}"
    return Warning(part.id, IMPOSSIBLE, said, constraint=part.is_constraint)


def in_words(clash: Conflict) -> str:
    """Return the conflict as the clauses of one sentence, in the order of their chain."""
    unique = list(dict.fromkeys(f"{c.text}{_placed(part, c.line)}" for part, c in _clauses(clash)))
    quantity = "all " if len(unique) > 2 else "both " if len(unique) > 1 else ""
    if len(unique) > MAX_CLAUSES:
        unique[MAX_CLAUSES - 1 :] = [f"{len(unique) - MAX_CLAUSES + 1} more such things"]
    return f"{_join(unique)} cannot {quantity}hold"


def clauses(clash: Conflict) -> tuple[Clause, ...]:
    """Return the conflict as single clauses."""
    return tuple(dict.fromkeys(clause for _, clause in _clauses(clash)))


def _clauses(clash: Conflict) -> list[tuple[Part, Clause]]:
    texts = [(r.part, _relation(r)) for r in clash.relations] + [(g.part, _gap(g)) for g in clash.gaps]
    found = [(part, Clause(part.id, part.line, text)) for part, text in texts]
    if clash.earliest is not None:
        part, point, seconds = clash.earliest
        found.append((part, Clause(part.id, None, f"{point} is not before {_seconds(seconds)}")))
    return found


def _candidates(clash: Conflict) -> Collection[Part]:
    optional = [part for part in clash.parts if not part.required]
    constraints = [part for part in optional if part.is_constraint]
    return constraints or optional or [part for part in clash.named if not part.required]


def _reason(clash: Conflict, dropped: Part) -> str:
    others = [part for part in _candidates(clash) if part is not dropped]
    if not others:
        required = any(part.required for part in (*clash.parts, *clash.named))
        return "everything else in this is required" if required else "nothing else has a part in this"
    if all(part.priority > dropped.priority for part in others):
        return "its priority is the lowest"
    return "it comes later"


def _relation(relation: Relation) -> str:
    left, sign, right = relation.words
    if sign == "rigid":
        return f"{left} takes exactly {_seconds(relation.seconds)} from its start to {right}"
    return f"{left} {'is ' if sign != '=' else ''}{sign} {right}"


def _placed(part: Part, line: int | None) -> str:
    words = [f"constraint {part.name}".strip()] if part.is_constraint else []
    if line is not None:
        words.append(f"line {line}")
    return f" ({', '.join(words)})" if words else ""


def _gap(gap: LengthBound) -> str:
    name = gap.part.name
    if gap.most:
        return f"{name} takes at most {_seconds(gap.seconds)} from {gap.begin} to {gap.end}"
    if gap.seconds > 0:
        return f"{name} takes at least {_seconds(gap.seconds)} from {gap.begin} to {gap.end}"
    return f"{name}:{gap.end} is not before {name}:{gap.begin}"


def _seconds(value: float) -> str:
    return f"{round(value, 3):g} s"


def _join(clauses: Sequence[str]) -> str:
    return clauses[0] if len(clauses) == 1 else f"{', '.join(clauses[:-1])} and {clauses[-1]}"
