"""Conversion of IPA phonemes to mixtures of MPEG-4 visemes, and of mouth shapes to FAPs."""

import math
from dataclasses import dataclass, fields
from functools import cache, lru_cache, partial
from itertools import chain
from typing import TypeAlias

import numpy as np

from realizer import tables
from realizer.core.array_types import Float64
from realizer.tables.phonemes import PhonemeFeatures, phoneme_features, symbols

VISEME_COUNT = 15  # 0 none, 1..14: ISO/IEC 14496-2
ROUNDED = 14  # the viseme of a rounded mouth
BILABIAL = 1
# Articulators that move on their own, and their columns.
ARTICULATORS = {
    "jaw": ("jaw",),
    "lips": ("upper", "lower"),
    "rounding": ("push_upper", "push_lower"),
    "spread": ("width", "corner"),
    "tip": ("tip", "thrust"),
    "body": ("body", "roll"),
}
SHAPE_COLUMNS = tuple(chain.from_iterable(ARTICULATORS.values()))
PAUSE = "pause"  # example of the parted lips of a pause
Mix: TypeAlias = tuple[tuple[int, float], ...]


@dataclass(frozen=True, slots=True)
class VisemeRule:
    """A row of phonemes_visemes.csv; the first that fits counts, and `any` fits all."""

    place: str
    manner: str
    viseme: int


@dataclass(frozen=True, slots=True)
class LipShape:
    """The target of each articulator in a viseme, in FAPU, and weights; the columns of `visemes.csv`."""

    viseme: int
    example: str
    jaw: float
    upper: float
    lower: float
    push_upper: float
    push_lower: float
    width: float
    corner: float
    tip: float
    thrust: float
    body: float
    roll: float
    weight_jaw: float
    weight_lips: float
    weight_rounding: float
    weight_spread: float
    weight_tip: float
    weight_body: float


@dataclass(frozen=True, slots=True)
class Articulation:
    """One articulation in a phoneme."""

    mix: Mix  # (viseme, part) pairs whose parts add up to 1; () if it has no lip shape
    vowel: bool  # whether it is a vowel
    share: float  # part of the phoneme's time, 0..1
    shape: Mix  # the same for the shapes of `lip_shapes`; differs from `mix` if the sound has its own targets


# () -> the 15 mouth shapes of visemes, index = viseme, then those of sounds that differ from them
lip_shapes = cache(partial(tables.csv_rows, "visemes.csv", LipShape))


@cache
def own_shapes() -> dict[str, int]:
    """Return IPA symbol -> its index in `lip_shapes`, for sounds with targets of their own."""
    rows = enumerate(lip_shapes()[VISEME_COUNT:], VISEME_COUNT)
    return {ipa: number for number, row in rows for ipa in row.example.split()}


# The constants of the dominance model; the file states their sources.
coarticulation = partial(tables.toml_table, "coarticulation.toml")


@cache
def shape_table() -> tuple[Float64, Float64]:
    """Return shapes (k, 11) in FAPU and weights (k, 6), with SHAPE_COLUMNS and ARTICULATORS as columns."""
    values = np.array([[getattr(row, f.name) for f in fields(LipShape)[2:]] for row in lip_shapes()])
    return values[:, : len(SHAPE_COLUMNS)], values[:, len(SHAPE_COLUMNS) :]


@lru_cache(maxsize=2048)
def sounds(ipa: str) -> tuple[Articulation, ...]:
    """Return the articulations of a phoneme string, in order; their shares add up to 1.

    A string may hold several sounds ("oʊ", "əl", "ɔːɹ", "tʃ"). Length, stress, tone and diacritics are
    ignored; unknown letters are replaced by their base letter or ignored.
    """
    found: list[tuple[Mix, Mix, bool]] = []
    for symbol, labialised in symbols(ipa):
        row = phoneme_features()[symbol]
        viseme = _viseme_of(row.place, row.manner)
        mix: Mix = _vowel_mix(row) if row.kind == "vowel" else ((viseme, 1.0),) if viseme else ()
        shape: Mix = ((own_shapes()[symbol], 1.0),) if symbol in own_shapes() else mix
        if labialised and mix and mix[0][0] not in coarticulation()["closure"]["visemes"]:
            mix, shape = (
                (*((number, part / 2) for number, part in parts), (ROUNDED, 0.5)) for parts in (mix, shape)
            )
        found.append((mix, shape, row.kind == "vowel"))
    consonant = coarticulation()["diphthong"]["consonant"]
    first_share = coarticulation()["diphthong"]["first"]
    lengths = [1.0 if vowel else consonant for *_, vowel in found]
    if len(found) == 2 and all(vowel for *_, vowel in found):
        lengths = [first_share, 1 - first_share]
    whole = sum(lengths)
    return tuple(
        Articulation(mix, vowel, t / whole, shape)
        for (mix, shape, vowel), t in zip(found, lengths, strict=True)
    )


def _vowel_mix(row: PhonemeFeatures) -> Mix:
    """Interpolate by height between the vowels of MPEG-4, separately for unrounded and rounded ones."""
    anchors = coarticulation()["vowels"]
    mix: dict[int, float] = {}
    for points, part in ((anchors["unrounded"], 1 - row.rounded), (anchors["rounded"], row.rounded)):
        heights = [height for height, _ in points]
        for k, (_, viseme) in enumerate(points):
            share = part * float(np.interp(row.height or 0.0, heights, np.eye(len(points))[k]))
            if share:
                mix[viseme] = mix.get(viseme, 0.0) + share
    return tuple(mix.items())


@cache
def _viseme_of(place: str, manner: str) -> int:
    rules = tables.csv_rows("phonemes_visemes.csv", VisemeRule)
    for rule in rules:
        if rule.place in (place, "any") and rule.manner in (manner, "any"):
            return rule.viseme
    return 0


ROLL = 1e5 * math.pi / 180  # units of FAP 47 in a degree


def mouth_faps(mouth: Float64) -> dict[int, Float64]:
    """Return the values (n,), in FAPU, of all FAPs that speech moves, by `SHAPE_COLUMNS` (n, 11)."""
    contour, pressure = coarticulation()["contour"], coarticulation()["pressure"]
    part = {name: mouth[:, k] for k, name in enumerate(SHAPE_COLUMNS)}
    # In MPEG-4 FAPs of the upper lip move it down, those of the lower lip up: both are negative when open.
    upper, lower = -part["upper"], -part["lower"]
    # The outer contours of lips that press against each other approach, and both lips roll in; those of
    # parted lips that are pushed forward turn out.
    pressed = (upper + lower).clip(0.0)
    thinner, inwards = pressed * pressure["outer"], pressed * pressure["inwards"]
    flare = contour["flare"] * (-(upper + lower) / contour["parted"]).clip(0.0, 1.0)
    upper_out = thinner - part["push_upper"].clip(0.0) * flare
    lower_out = thinner - part["push_lower"].clip(0.0) * flare
    values: dict[tuple[int, ...], Float64] = {
        (3,): part["jaw"].clip(0.0),  # FAP 3 has one direction
        (4,): upper,
        (5,): lower,
        (8, 9): upper * contour["side"],
        (10, 11): lower * contour["side"],
        (51,): upper * contour["outer"] + upper_out,
        (52,): lower * contour["outer"] + lower_out,
        (55, 56): upper * contour["outer_side"] + upper_out,
        (57, 58): lower * contour["outer_side"] + lower_out,
        (6, 7, 53, 54): part["width"],
        (12, 13, 59, 60): part["corner"],
        (16,): part["push_lower"] - inwards,
        (17,): part["push_upper"] - inwards,
        (44,): part["tip"],
        (45,): part["thrust"],
        (46,): part["body"],
        (47,): part["roll"].clip(0.0) * ROLL,  # FAP 47 has one direction too
    }
    return {number: value for numbers, value in values.items() for number in numbers}
