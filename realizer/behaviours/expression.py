"""expression: a name of the expression library -> its action units, for about as long as people show it."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import numpy as np

from bml_schema import Expression
from realizer.animation.channel import Channel
from realizer.arrays import Float64
from realizer.behaviours import poses
from realizer.behaviours.kind import Fault, Kind, World
from realizer.behaviours.preferred import from_gaps, preferred
from realizer.scheduling.timing import Timing
from realizer.tables.lexemes import face_lexemes
from realizer.tables.templates import Template, templates
from realizer.tables.timing import Gap, gaps

__all__ = ["KINDS"]

PREFIX = "TEMPLATE:"


def timing(node: Expression, world: World) -> Timing:
    """A template's as it was measured, every other as of the face lexeme of its name."""
    name = _key(node.name)
    if not name.startswith(PREFIX):
        return preferred("faceLexeme", name)
    return _measured(templates()[name.removeprefix(PREFIX)])


def expand(node: Expression, times: Float64, world: World) -> tuple[Channel, ...]:
    """There at attackPeak, held to relax, gone at end."""
    return poses.shown(poses.columns(library()[_key(node.name)], node.intensity), times, node.id)


def check(node: Expression, world: World) -> tuple[Fault, ...]:
    """An unknown name is fatal."""
    if _key(node.name) in library():
        return ()
    own = [(PREFIX + name).lower() for name in templates()]
    return (poses.unknown("name", node.name, [*face_lexemes(), *own]),)


@cache
def library() -> Mapping[str, Mapping[tuple[int, str], float]]:
    """Upper-case name -> (AU, side) -> intensity; the templates as "TEMPLATE:NAME"."""
    own = {PREFIX + name: template.aus for name, template in templates().items()}
    return own | {name: lexeme.aus for name, lexeme in face_lexemes().items()}


def _key(name: str) -> str:
    """Either case; "ironic smile", "ironic-smile" and "ironic_smile" are one template."""
    name = name.upper()
    if name.startswith(PREFIX):
        words = name.removeprefix(PREFIX).replace("-", " ").replace("_", " ").split()
        return PREFIX + " ".join(words)
    return name


def _measured(template: Template) -> Timing:
    """The hold fills what the average, within its probable range, leaves beside half of attack and relax."""
    row = gaps("face")
    attack, hold, relax = row.gaps
    evident = template.evident
    if template.probable is not None:
        evident = float(np.clip(evident, *template.probable))
    held = max(evident - attack.preferred / 2 - relax.preferred / 2, 0.0)
    stiffness = hold.stiffness if template.deviation is None else template.deviation**-2
    own = Gap("hold", held, 0.0, stiffness, "Wojdel 2005 tables 6.4 and 6.15")
    return from_gaps(row.points, (attack, own, relax))


KINDS = (
    Kind(
        Expression,
        timing,
        expand,
        check,
        parameters={"intensity": "intensity", "amount": "intensity"},
    ),
)
