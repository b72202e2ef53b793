"""What a study asks: kinds of questions about variants of faces, drawn by a seed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from realizer.face.load import list_faces
from realizer_studio.study.drawing import Drawer, Variant
from realizer_studio.study.films import films
from realizer_studio.study.items import KINDS, Item, checks, displacements, naming
from realizer_studio.study.kit import texts
from realizer_studio.study.matching import TRIPLES, Reference, matching, references

MATCHING = ("visual", "emotional")
# About how many pictures or films are drawn for each variant.
DRAWN = {"visual": 300, "emotional": 300, "naming": 36, "displacements": 129, "films": 16}


@dataclass(frozen=True)
class Plan:
    """A study."""

    kinds: Sequence[str]  # of `KINDS`
    variants: Sequence[Variant]  # ways to draw faces, which are compared
    source: str | None = None  # folder of photographs to compare with, a face, or None for another face
    language: str = "en"  # of films
    most: int | None = None  # questions of each kind at most; None: all
    seed: int = 0  # of all choices

    @property
    def drawn(self) -> int:
        """About how many pictures are drawn."""
        return sum({DRAWN[kind] for kind in self.kinds}) * len(self.variants)

    def items(self, step: Callable[[int], object] = lambda count: None) -> list[Item]:
        """Return all questions, with attention items; errors as `references`, `matching` and `films`.

        `step` is called with 1 after each picture or film.
        """
        draws = np.random.default_rng(self.seed)
        found: list[Item] = []
        with Drawer(step) as draw:
            if matched := [kind for kind in MATCHING if kind in self.kinds]:
                shown = self._references(draw, draws)
                for variant in self.variants:
                    found += matching(matched, variant, shown, draw, draws)
            if "naming" in self.kinds:
                found += naming(self.variants, draw)
            if "displacements" in self.kinds:
                found += displacements(self.variants, draw)
        if "films" in self.kinds:
            spoken = texts()[self.language]["films"][: self.most]
            found += films(self.variants, spoken, self.language, draws, step)
        chosen: list[Item] = []
        for kind in [kind for kind in KINDS if kind in self.kinds]:
            mine = [item for item in found if item.kind == kind]
            if self.most is not None and len(mine) > self.most:
                mine = [mine[k] for k in draws.choice(len(mine), self.most, replace=False)]
            chosen += [*mine, *checks(mine, draws)]
        return chosen

    def _references(self, draw: Drawer, draws: np.random.Generator) -> list[Reference]:
        """Return the references, at most as many as are needed."""
        used = [one.face for one in self.variants]
        others = (info.name for info in list_faces() if info.name not in used)
        other = self.source or next(others, used[0])
        shown = references(other, draw)
        if self.most is None:
            return shown
        return [shown[k] for k in draws.permutation(len(shown))[: -(-self.most // TRIPLES)]]
