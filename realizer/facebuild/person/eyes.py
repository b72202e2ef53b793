"""The eyeballs of a person behind the lids."""

import numpy as np

from realizer.core.array_types import Float64
from realizer.face.mesh_geometry import fit_ball
from realizer.facebuild.eyeball import CORNEA, cornea
from realizer.facebuild.person.base_mesh import Ground
from realizer.facebuild.person.lids import Lid

Ball = tuple[Float64, float]  # centre (3,) and radius, metres
INSET = 0.00015  # m; how much deeper the ball lies than the socket's fit
RISE = 0.085  # of the distance between the lids: how far pupils are above the middle, as people's are
CLEAR = 0.00030, 0.00065  # m from the ball to the lid's edge and to the ring of vertices in front of it


def balls(ground: Ground) -> tuple[Ball, Ball]:
    """Return the left and the right eyeball: they fit the sockets, at a height that suits the lids."""
    made = []
    for side, upper, lower in (("l", "3.1", "3.3"), ("r", "3.2", "3.4")):
        centre, radius = fit_ball(ground.at[np.unique(ground.mesh.quads[f"helper-{side}-eye"])])
        high, low = ground.point(upper)[1], ground.point(lower)[1]
        centre[1] = (high + low) / 2 + RISE * (high - low)
        made.append((centre, radius - INSET))
    return made[0], made[1]


def cleared(ground: Ground, eyes: tuple[Ball, Ball]) -> Float64:
    """Return the base mesh (n, 3) with edges of the lids that are not inside balls and corneas."""
    at = ground.at.copy()
    for side, (centre, radius) in zip((1, -1), eyes, strict=True):
        before, _ = cornea(radius)
        for ring, room in zip(Lid(ground, side).rings, CLEAR, strict=False):
            for middle, size in ((centre, radius), (centre + np.array([0, 0, before]), CORNEA)):
                away = at[ring] - middle
                left = (size + room) ** 2 - away[:, 0] ** 2 - away[:, 1] ** 2
                push = np.sqrt(np.maximum(left, 0)) - away[:, 2]
                at[ring, 2] += np.where((left > 0) & (away[:, 2] > 0), np.maximum(push, 0), 0)
    return at
