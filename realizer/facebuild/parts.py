"""The parts of a face that is being built."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.facebuild.submesh import Submesh


@dataclass(eq=False)
class Part:
    """A part of a face that is being built.

    Attributes:
        patch: where its vertices come from on the base mesh, or None.
        vertices: (n, 3) metres; triangles: (m, 3); colours: (n, 3) sRGB 0..255; gloss: (n,) 0..1.
        occlusion: (n,) 0..1, or None: to be baked.
        fields: row number -> (n, 3), where the part brings its own.
        uv: (n, 2) places in the maps, or None: it has none of its own.
    """

    name: str
    patch: Submesh | None
    vertices: Float64
    triangles: Int32
    colours: Float64
    gloss: Float64
    occlusion: Float64 | None = None
    fields: dict[int, Float64] = field(default_factory=dict)
    uv: Float64 | None = None

    def subset(self, index: Any, triangles: Int32) -> Part:
        """Return the part with only these of its vertices, (k,) indices, and other triangles over them."""
        patch = self.patch and Submesh(self.patch.mix[index], self.patch.offset[index], triangles)
        light = None if self.occlusion is None else self.occlusion[index]
        fields = {number: moves[index] for number, moves in self.fields.items()}
        return Part(
            self.name, patch, self.vertices[index], triangles, self.colours[index], self.gloss[index], light,
            fields, None if self.uv is None else self.uv[index],
        )  # fmt: skip


def smooth(x: Any, low: Any, high: Any) -> Any:
    """Return 0 below low, 1 above high, smooth between (Perlin's cubic); falls where high < low."""
    t = np.clip((np.asarray(x, float) - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)
