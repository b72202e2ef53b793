"""The successive mixer on a mesh: each unit displaces what the units before it left."""

from collections.abc import Mapping

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.au.model import Model, half
from realizer.face.au.mouth import shares
from realizer.face.au.skin_binding import attached_parts, skin
from realizer.face.model import Face

LEAST = 1e-5  # m; smaller movements of a unit are ignored
# The limit of a unit's movement, as a multiple of its largest on the neutral face. Off the skin, where its
# functions were not fitted, they may grow without bounds.
FURTHEST = 1.3


class Succession:
    """The successive mixer (Wojdel 2005, 5.1): each unit moves the places where those before it left them.

    Places that no unit has moved yet are displaced as on the neutral face, which is computed once. Where
    units overlap, their functions are evaluated again at every call.
    """

    def __init__(self, face: Face, model: Model) -> None:
        self._face, self._model = face, model
        self._mine = np.flatnonzero(skin(face))
        self._at = face.vertices[self._mine].astype(np.float64)
        self._upper = shares(face, model.mouth)[self._mine]
        self._roots = attached_parts(face)
        self._still: dict[int, tuple[Float64, float]] = {}

    def __call__(self, values: Mapping[int, tuple[float, float]]) -> Float64:
        """Apply units one after the other in the order of the mapping.

        Args:
            values: action unit -> intensities 0..1 on the left and on the right.

        Returns:
            (n_vertices, 3) metres from the neutral place.
        """
        moves, moved = np.zeros_like(self._at), np.zeros(len(self._at), bool)
        for au, amounts in values.items():
            neutral, furthest = self._neutral(au)
            step = neutral * _amount(self._at, *amounts)
            again = np.flatnonzero(moved)
            at = self._at[again] + moves[again]
            here = self._model.displacement(au, at, upper=self._upper[again])
            here *= furthest / np.maximum(np.linalg.norm(here, axis=1, keepdims=True), furthest)
            step[again] = here * _amount(at, *amounts)
            moves += step
            moved |= step.any(axis=1)
        out = np.zeros((len(self._face.vertices), 3))
        out[self._mine] = moves
        for first, last, corners, share in self._roots:
            out[first:last] = np.einsum("nk,nkc->nc", share, out[corners])
        return out

    def _neutral(self, au: int) -> tuple[Float64, float]:
        """Return a unit's displacement of the neutral face, (k, 3), and its limit for any place, metres."""
        if au not in self._still:
            moves = self._model.displacement(au, self._at, upper=self._upper)
            moves[np.abs(moves).max(axis=1) < LEAST] = 0
            furthest = max(FURTHEST * float(np.linalg.norm(moves, axis=1).max()), LEAST)
            self._still[au] = moves, furthest
        return self._still[au]


def _amount(at: Float64, left: float, right: float) -> Float64 | float:
    """Return the weight of a unit at each place: (n, 1), or one number if both sides are alike."""
    if left == right:
        return left
    return (left * half(at, "L") + right * half(at, "R"))[:, None]
