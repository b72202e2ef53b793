"""Expansion of visemes and expressions (FAP 1 and 2) into the FAPs that show them."""

from dataclasses import dataclass, replace
from functools import cache, partial

import numpy as np

from realizer import tables
from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.lips.visemes import VISEME_COUNT, mouth_faps, shape_table
from realizer.core.array_types import Float64, Int32
from realizer.emotions.archetypes import archetypes

MOST = 63  # of viseme_blend, and of the intensities of expressions


@dataclass(frozen=True, slots=True)
class FapExpression:
    """The archetype of an expression_select of FAP 2."""

    number: int
    emotion: str


# () -> all expressions but 0, which is none
fap_expressions = cache(partial(tables.csv_rows, "fap_expressions.csv", FapExpression))


def expand_compound(clip: FAPClip) -> FAPClip:
    """Return a clip with FAP 1 and 2 expanded to FAPs 3 to 68; a clip without them is not changed.

    - Visemes and expressions are mixed as ISO/IEC 14496-2 specifies: viseme_select1 x blend / 63 +
      viseme_select2 x (1 - blend / 63), and each expression x its intensity / 63.
    - With both, a viseme reduces an expression as speech does, because it moves the lips.
    - A FAP that the clip itself defines is kept, also at 0; with init_face it is added to the expression.

    What cannot be shown is left out, with a sentence in `notes`.
    """
    if not clip.mask[:2].any():
        return clip
    notes: list[str] = []
    visemes, talking = _visemes(clip.visemes, notes)
    expressions = _expressions(clip.expressions, notes)
    own = np.array([row.speech_owns for row in tables.faps()])
    expressions *= 1 - talking[:, None] * own
    mixed = visemes + expressions
    relative = (clip.expressions[:, 4:5] == 1) * expressions
    values = np.where(clip.mask, clip.values + relative, mixed)
    # Between two visemes the lips are held at 0, so that no other behaviour moves them.
    mask = clip.mask | (talking.any() & _viseme_shapes().any(axis=0)) | expressions.any(axis=0)
    mask[:2] = False
    values[:, :2] = 0
    count = len(values)
    return replace(
        clip,
        values=np.rint(values).astype(np.int32),
        mask=mask,
        visemes=np.zeros((count, 4), np.int32),
        expressions=np.zeros((count, 6), np.int32),
        notes=(*clip.notes, *notes),
    )


def _visemes(given: Int32, notes: list[str]) -> tuple[Float64, Float64]:
    """Return (n, 68) FAPs of the visemes, and (n,) 0..1 their total weight."""
    selects = _known_numbers(given[:, :2], len(_viseme_shapes()), "FAP 1: wanted visemes", notes)
    share = _fractions(given[:, 2], "FAP 1: wanted blends", notes)
    _note_definition(given[:, 3], "FAP 1: viseme_def", notes)
    parts = np.stack([share, 1 - share], axis=1)
    return np.einsum("np,npf->nf", parts, _viseme_shapes()[selects]), (parts * (selects > 0)).sum(axis=1)


def _expressions(given: Int32, notes: list[str]) -> Float64:
    selects = _known_numbers(given[:, [0, 2]], len(_expression_shapes()), "FAP 2: wanted expressions", notes)
    parts = _fractions(given[:, [1, 3]], "FAP 2: wanted intensities", notes)
    _note_definition(given[:, 5], "FAP 2: expression_def", notes)
    out: Float64 = np.einsum("np,npf->nf", parts, _expression_shapes()[selects])
    return out


def _known_numbers(given: Int32, count: int, wanted: str, notes: list[str]) -> Int32:
    """Return the numbers, with 0, which is none, instead of unknown ones."""
    known = (given >= 0) & (given < count)
    if not known.all():
        notes.append(f"{wanted} 0..{count - 1}, got {given[~known][0]}: shown as none")
    return np.where(known, given, 0)


def _fractions(given: Int32, wanted: str, notes: list[str]) -> Float64:
    """Scale 0..63 to 0..1."""
    limited = np.clip(given, 0, MOST)
    if (limited != given).any():
        notes.append(f"{wanted} 0..{MOST}, got {given[limited != given][0]}: limited to it")
    parts: Float64 = limited / MOST
    return parts


def _note_definition(flags: Int32, name: str, notes: list[str]) -> None:
    if flags.any():
        notes.append(f"{name} gives a meaning of its own, which is not heeded")


@cache
def _viseme_shapes() -> Float64:
    """Return (15, 68) FAPU, a row a viseme."""
    shapes = shape_table()[0][:VISEME_COUNT]
    out = np.zeros((len(shapes), 68))
    for number, values in mouth_faps(shapes).items():
        out[:, number - 1] = values
    return out


@cache
def _expression_shapes() -> Float64:
    """Return (7, 68) FAPU, a row an expression; 0 is none."""
    rows = fap_expressions()
    out = np.zeros((1 + max(row.number for row in rows), 68))
    for row in rows:
        out[row.number] = archetypes("own")[row.emotion][0].frame()
    return out
