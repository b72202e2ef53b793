"""The wet line: a strip of tears between the edge of each lower lid and the eye."""

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from realizer.core.array_types import Float64
from realizer.face.mesh_geometry import grid
from realizer.facebuild.parts import Part
from realizer.facebuild.person.base_mesh import UP, Ground
from realizer.facebuild.person.lids import Lid
from realizer.facebuild.submesh import Submesh

TALL = 0.00045  # m up the eye
# From the lid's edge up the eye: share of the way, and of the edge's distance from the eye; tears are hollow.
RINGS = (0.0, 1.0), (0.4, 0.3), (1.0, 0.0)
THIN = 0.00015  # m before the eye at the top
TINT = np.array([204.0, 172, 164])  # the lid's pink seen through


def tears(ground: Ground, lids: Sequence[Lid], eyes: Sequence[tuple[Float64, float]]) -> Part:
    """Return the strips of both eyes, which follow the edges of the lids.

    Args:
        eyes: centre (3,) and radius of each ball.
    """
    places: list[Float64] = []
    sources: list[int] = []
    triangles = []
    for lid, (centre, radius) in zip(lids, eyes, strict=True):
        edge = ground.at[lid.lower]
        count = len(edge)
        # Into the corners it gets thin.
        tall = TALL * np.sqrt(np.sin(np.pi * np.arange(count) / (count - 1)))
        room = np.linalg.norm(edge - centre, axis=1) - radius
        rows = []
        for share, before in RINGS:
            way = edge + share * tall[:, None] * UP - centre
            far = radius + THIN + before * np.maximum(room - THIN, 0)
            rows.append(centre + way * (far / np.linalg.norm(way, axis=1))[:, None])
        turned = grid(len(RINGS), count)
        triangles.append((turned if lid.side < 0 else turned[:, ::-1]) + len(sources))
        places.append(np.concatenate(rows))
        sources += lid.lower * len(RINGS)
    at, source = np.concatenate(places), np.array(sources)
    n = len(at)
    mix = sp.csr_matrix((np.ones(n), (np.arange(n), source)), (n, len(ground.at)))
    patch = Submesh(mix, at - ground.at[source], np.concatenate(triangles).astype(np.int32))
    return Part("tears", patch, at, patch.triangles, np.tile(TINT, (n, 1)), np.ones(n), np.full(n, 0.85))
