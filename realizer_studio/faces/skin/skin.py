"""The skin of a person at the texels of its maps, with the fields that all maps use."""

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.ndimage import gaussian_filter1d
from scipy.spatial import cKDTree

from realizer.core.array_types import Bool, Float32, Float64
from realizer.face.mesh_geometry import vertex_normals
from realizer.tables import toml_table
from realizer_studio.faces.parts import Part, smooth
from realizer_studio.faces.person.lids import Lid
from realizer_studio.faces.person.lips import BORDER, RING_SIZE, Lips
from realizer_studio.faces.person.person import Person
from realizer_studio.faces.person.recipe import Recipe, appearance_of
from realizer_studio.faces.skin.noise import noise
from realizer_studio.faces.skin.texels import Texels

ROUNDED = 3.0  # texels; radius by which rings are smoothed, which have corners at vertices
FINE = 0.0025  # m; noise of greater length is interpolated from few points
EVEN = 1.6  # vertices; radius by which the border of the red is smoothed


class Skin:
    """A person's skin.

    Attributes:
        texels: of the maps; part: the skin of the mesh.
        person, lips, lids, recipe: of the person; look: numbers of the recipe.
        table: `realizer/tables/skin.toml`.
        seed: of the person's spots and lines.
        ring: (k,) position across the lips: 0 inside, 1 where they meet, 7 the border of the red, 11 beyond.
        red: (k,) 0..1, weight of the red of the lips.
        dry: (k,) bool, texels that are not in the mouth.
    """

    def __init__(
        self,
        texels: Texels,
        part: Part,
        person: Person,
        lips: Lips,
        lids: list[Lid],
        recipe: Recipe,
        seed: int,
    ) -> None:
        self.texels, self.part, self.person, self.lips, self.lids = texels, part, person, lips, lids
        self.recipe, self.look, self.seed = recipe, appearance_of(recipe.look), seed
        self.table: dict[str, Any] = toml_table("skin.toml")
        ring = np.where(lips.inside, 0, len(lips.rings) + 1.0)
        for k, loop in enumerate(lips.rings):
            ring[loop] = k
        self.ring = self._bordered(texels.blurred(self.field(ring), ROUNDED))
        self.dry: Bool = self.field(lips.inside) < 0.5
        # The red of the lower lip ends in the crease below it.
        shift = 0.12 * self.noise(0.0022, 1, self.ring < 10) - 0.7 * (1 - self.field(lips.is_upper))
        self.red: Float32 = self.float(smooth(self.ring + shift, *self.table["lips"]["border"])) * self.dry

    def _bordered(self, ring: Float32) -> Float32:
        """Return positions across the lips with a smooth border of the red instead of the mesh's."""
        at, t = self.person.figure.at, np.arange(RING_SIZE + 1)
        inner, line, outer = (at[self.lips.rings[k]] for k in (BORDER - 1, BORDER, BORDER + 1))
        gap = np.linalg.norm(outer - inner, axis=1, keepdims=True) / 2
        across = gaussian_filter1d((outer - inner) / gap**2 / 2, 3 * EVEN, axis=0, mode="wrap")
        corner = np.abs(self.lips.u[self.lips.rings[BORDER]])[:, None]
        even = gaussian_filter1d(line, EVEN, axis=0, mode="wrap")
        line = even + (line - even) * smooth(corner, 0.75, 0.95)
        where = np.linspace(0, RING_SIZE, 12 * RING_SIZE, endpoint=False)
        line, across = (
            CubicSpline(t, np.concatenate([part, part[:1]]), bc_type="periodic")(where)
            for part in (line, across)
        )
        near = np.flatnonzero((ring > 4.5) & (ring < BORDER + 3.5))
        point = cKDTree(line).query(self.at[near])[1]
        found = BORDER + ((self.at[near] - line[point]) * across[point]).sum(axis=1)
        share = smooth(ring[near], 4.5, 5.5) * smooth(ring[near], BORDER + 3.5, BORDER + 1.5)
        out = ring.copy()
        out[near] += self.float(share * (np.clip(found, 4, 11) - ring[near]))
        return out

    @property
    def at(self) -> Float32:
        """Positions of the texels, (k, 3) metres."""
        return self.texels.at

    def rng(self, number: int) -> np.random.Generator:
        """Return the person's random generator for one purpose."""
        return np.random.default_rng([self.seed, number])

    def noise(self, length: float, number: int, mask: Any = None) -> Float32:
        """Return the person's smooth noise (k,) for one purpose.

        Args:
            length: metres between independent values; number: of the purpose.
            mask: (k,) if given, noise is 0 where it is 0.
        """
        field = partial(noise, length=length, seed=self.seed + number)
        return self.texels.broad(field) if length > FINE else self.within(mask, field)

    def within(self, mask: Any, field: Callable[[Float32], Any], at: Any = None) -> Float32:
        """Return a function of positions (j, 3) at the texels where a mask (k,) is not 0, and 0 elsewhere."""
        at = self.at if at is None else at
        out = np.zeros(len(at), np.float32)
        some = slice(None) if mask is None else np.asarray(mask) != 0
        out[some] = field(at[some])
        return out

    def field(self, values: Any) -> Float32:
        """Return values of the base mesh's vertices (n, ...) at the texels (k, ...)."""
        return self.texels.spread(self.part.submesh.mix @ np.asarray(values, float))

    def around(self, *names: str, radii: Any, offset: Any = (0, 0, 0)) -> Float32:
        """Return weights (k,) that fall from 1 at feature points (plus an offset) to 0 on ellipsoids."""
        figure = self.person.figure

        def field(at: Float32) -> Any:
            out = np.zeros(len(at))
            for name in names:
                position = figure.point(name)
                middle = position + np.asarray(offset) * [np.sign(position[0]) or 1, 1, 1]
                distance = np.linalg.norm((at - middle) / np.asarray(radii), axis=1)
                out = np.maximum(out, (1 + np.cos(np.pi * np.clip(distance, 0, 1))) / 2)
            return out

        return self.texels.broad(field)

    def normals(self) -> Float32:
        """Return unit normals of the texels, (k, 3)."""
        vectors = self.texels.spread(vertex_normals(self.part.vertices, self.part.triangles))
        return self.float(vectors / np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-9))

    @staticmethod
    def float(values: Any) -> Float32:
        """Return values as float32."""
        return np.asarray(values, np.float32)

    def margins(self) -> tuple[Float32, Float32]:
        """Return the wet edges of the lids, and the caruncles in the inner corners, 0..1 (k,) each."""
        edge = np.zeros(len(self.person.figure.at))
        for lid in self.lids:
            edge[lid.rings[0]] = 1
        corners = self.around("3.8", "3.11", radii=(0.0045, 0.0032, 0.0050))
        return self.field(edge), self.float(smooth(corners, 0.15, 0.6))

    def oily(self) -> Float32:
        """Return the weight (k,) 0..1 of oily skin: nose, forehead, chin."""
        nose = self.around("9.3", radii=(0.022, 0.020, 0.03))
        wings = self.around("9.1", "9.2", radii=(0.016, 0.018, 0.02))
        brow = self.around("9.12", radii=(0.045, 0.050, 0.05), offset=(0, 0.035, 0))
        chin = self.around("2.10", radii=(0.020, 0.016, 0.03))
        return self.float(np.clip(nose + wings + 0.55 * brow + 0.5 * chin, 0, 1))

    def pored(self) -> Float32:
        """Return the weight (k,) 0..1 of large pores: on the nose and the cheeks beside it."""
        nose = self.around("9.3", "9.1", "9.2", radii=(0.022, 0.022, 0.03))
        cheeks = self.around("5.3", "5.4", radii=(0.034, 0.030, 0.05), offset=(-0.012, 0, 0.01))
        brow = self.around("9.12", radii=(0.045, 0.050, 0.05), offset=(0, 0.035, 0))
        chin = self.around("2.10", radii=(0.022, 0.018, 0.03))
        pored = self.float(np.clip(nose + 0.75 * cheeks + 0.4 * brow + 0.5 * chin, 0, 1))
        return pored * self.dry * (1 - self.red)

    def mark(self, name: str, mask: Any, number: int) -> Any:
        """Return centres (c,), as texels, and radii (c,) of random marks of a kind in the table.

        Args:
            mask: (k,) 0..1, relative density.
        """
        row, rng = self.table[name], self.rng(number)
        least, most = row["radius"]
        found = self.texels.scatter(row["density"] * self.float(mask), row.get("apart", most), rng)
        return found, self.float(least + (most - least) * rng.random(len(found)) ** 2.5)


def distance_through(vertices: Float64, normals: Float64, among: Any, full: float) -> Float64:
    """Return the thickness (n,) in metres: the distance from each vertex to the opposite surface behind it.

    Args:
        among: (j,) vertices of the opposite surface; full: metres, the maximum.
    """
    out = np.full(len(vertices), full)
    near = cKDTree(vertices[among]).query_ball_point(vertices, full)
    for k, found in enumerate(near):
        candidates = among[found]
        offset = vertices[candidates] - vertices[k]
        distance = np.linalg.norm(offset, axis=1)
        behind = (normals[candidates] @ normals[k] < -0.2) & (-offset @ normals[k] > 0.6 * distance)
        if behind.any():
            out[k] = distance[behind].min()
    return out
