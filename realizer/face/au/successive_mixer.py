"""The successive mixer: action units displace a mesh one after the other."""

from collections.abc import Mapping

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.au.model import Model, half
from realizer.face.au.regions import attached_parts, shares, skin
from realizer.face.model import Face

MIN_MOVE = 1e-5  # m; smaller displacements are ignored
# Largest displacement by a unit, as a multiple of its largest one on the neutral face. Outside the neutral
# skin, where the functions were not fitted, they may grow without bounds.
MAX_RATIO = 1.3


class SuccessiveMixer:
    """The successive mixer (Wojdel 2005, 5.1): each unit displaces the displaced vertices.

    The displacements of the neutral face are computed once. They hold for vertices that no earlier unit has
    moved; for all others the functions are evaluated at every call.
    """

    def __init__(self, face: Face, model: Model) -> None:
        self._face, self._model = face, model
        self._skin_vertices = np.flatnonzero(skin(face))
        self._neutral_places = face.vertices[self._skin_vertices].astype(np.float64)
        self._upper_share = shares(face, model.mouth)[self._skin_vertices]
        self._attached = attached_parts(face)
        self._neutral_cache: dict[int, tuple[Float64, float]] = {}

    def __call__(self, values: Mapping[int, tuple[float, float]]) -> Float64:
        """Apply units one after the other in the order of the mapping.

        Args:
            values: action unit -> intensities 0..1 on the left and on the right.

        Returns:
            (n_vertices, 3) metres from the neutral place.
        """
        displacement = np.zeros_like(self._neutral_places)
        is_moved = np.zeros(len(displacement), bool)
        for au, amounts in values.items():
            neutral, limit = self._neutral(au)
            step = neutral * _amount(self._neutral_places, *amounts)
            moved_before = np.flatnonzero(is_moved)
            at = self._neutral_places[moved_before] + displacement[moved_before]
            moved = self._model.displacement(au, at, upper=self._upper_share[moved_before])
            moved *= limit / np.maximum(np.linalg.norm(moved, axis=1, keepdims=True), limit)
            step[moved_before] = moved * _amount(at, *amounts)
            displacement += step
            is_moved |= step.any(axis=1)
        out = np.zeros((len(self._face.vertices), 3))
        out[self._skin_vertices] = displacement
        for first, last, corners, share in self._attached:
            out[first:last] = np.einsum("nk,nkc->nc", share, out[corners])
        return out

    def _neutral(self, au: int) -> tuple[Float64, float]:
        """Return a unit's displacement of the neutral face, (k, 3), and its limit for any vertex, metres."""
        if au not in self._neutral_cache:
            moves = self._model.displacement(au, self._neutral_places, upper=self._upper_share)
            moves[np.abs(moves).max(axis=1) < MIN_MOVE] = 0
            limit = max(MAX_RATIO * float(np.linalg.norm(moves, axis=1).max()), MIN_MOVE)
            self._neutral_cache[au] = moves, limit
        return self._neutral_cache[au]


def _amount(at: Float64, left: float, right: float) -> Float64 | float:
    """Return the intensity of a unit at each vertex: (n, 1), or one number if both sides are equal."""
    if left == right:
        return left
    return (left * half(at, "L") + right * half(at, "R"))[:, None]
