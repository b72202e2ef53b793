"""Questions about single faces: emotions to name, and displacements of FAPs (Paul 2010, 4.4)."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from realizer.emotions.archetypes import archetypes
from realizer.tables import faps
from realizer.tables.emotions import ring
from realizer_studio.faces.mpeg4.fap_scores import weights
from realizer_studio.study.difference_image import difference, faint
from realizer_studio.study.drawing import FRONT, Drawer, Variant, opaque, row, webp

EMOTIONS = ("anger", "disgust", "fear", "joy", "sadness", "surprise")
NAMES = (*EMOTIONS, "trust", "anticipation", "other")
PROFILES = ("own", "published", "raw")
STRENGTHS = (0.5, 1.0)
HALF, TURN = 512, 34907  # half of the unit distance (Paul 2010, 4.4.2), and 20 degrees for rotations
SCORES = ("3", "2", "1", "0")
# Answers other than the pictures to choose from.
ANSWERS: Mapping[str, tuple[str, ...]] = {
    "visual": ("none",),
    "emotional": ("none",),
    "naming": NAMES,
    "displacements": SCORES,
    "films": ("same",),
}
KINDS = tuple(ANSWERS)
WHEEL = {place.name: place.angle for place in ring("paul").values() if place.kind == "basic"}


@dataclass(frozen=True, eq=False)
class Item:
    """One question of a study."""

    kind: str  # one of `KINDS`
    truth: Mapping[str, Any]  # facts that are only in the key
    # Role -> picture (WebP) of the question, such as "reference".
    shown: Mapping[str, bytes] = field(default_factory=dict)
    # Role -> picture or film to choose from, such as "right"; empty if answers are words.
    options: Mapping[str, bytes] = field(default_factory=dict)
    text: Mapping[str, str] = field(default_factory=dict)  # texts of the question
    # The answer that an attention item requests, or None.
    check: str | None = None


def naming(variants: Sequence[Variant], draw: Drawer) -> Iterator[Item]:
    """Yield the six archetypes of each set of profiles at two strengths, for each variant."""
    for variant in variants:
        for profiles in PROFILES:
            found = {name: next(iter(archetypes(profiles)[name].values())) for name in EMOTIONS}
            cases = [(name, strength) for name in EMOTIONS for strength in STRENGTHS]
            frames = [found[name].scaled(strength).frame() for name, strength in cases]
            rows = [row(faps=dict(enumerate(values.tolist(), 1))) for values in frames]
            for (name, strength), picture in zip(cases, draw(variant, rows), strict=True):
                truth = {"variant": variant.name, "emotion": name, "profiles": profiles, "strength": strength}
                yield Item("naming", truth | {"angle": ring("paul")[name].angle}, {"face": webp(picture)})


def displacements(variants: Sequence[Variant], draw: Drawer) -> Iterator[Item]:
    """Yield the 127 displacements of low-level FAPs for each variant (Paul 2010, 4.4.2).

    Forward displacements are drawn in profile. `truth["moves"]` is False if no pixel changes.
    """
    cases = []
    for found in faps()[2:]:
        size = TURN if found.unit == "angle_unit" else HALF
        camera = "profile" if found.direction == "forward" else FRONT
        ends = (min(size, found.most), max(-size, found.least))
        cases += [(found, value, camera) for value in ends if value]
    for variant in variants:
        for camera in (FRONT, "profile"):
            selected = [(found, value) for found, value, view in cases if view == camera]
            rows = [row(), *(row(faps={found.fap: value}) for found, value in selected)]
            rest, *pictures = draw(variant, rows, camera)
            for (found, value), picture in zip(selected, pictures, strict=True):
                difference_picture = difference(opaque(picture), opaque(rest), faint(rest))
                pictures_ = {
                    "neutral": webp(rest),
                    "moved": webp(picture),
                    "difference": webp(difference_picture),
                }
                sign = 1 if value > 0 else -1
                truth = {"variant": variant.name, "fap": found.fap, "sign": sign, "name": found.name}
                truth |= {"weight": weights()[found.fap], "moves": bool((picture != rest).any())}
                direction = f"{found.direction}{'' if sign > 0 else ', reversed'}"
                text = {"fap": f"FAP {found.fap} {found.name} {value:+g} ({direction})"}
                yield Item("displacements", truth, pictures_, text=text)


def checks(items: Sequence[Item], draws: np.random.Generator) -> list[Item]:
    """Return attention items for questions of one kind: one per twenty questions, at least two."""
    found = []
    for k in draws.choice(len(items), max(2, len(items) // 20)):
        item = items[k]
        answer = str(draws.choice(ANSWERS[item.kind]))
        found.append(Item(item.kind, {"check": answer}, item.shown, item.options, item.text, answer))
    return found
