"""The surface map of a skin: occlusion of small cavities, roughness and thickness."""

import numpy as np

from realizer.core.array_types import Float32
from realizer.face.mesh_geometry import vertex_normals
from realizer.facebuild.parts import smooth
from realizer.facebuild.skin.relief import Relief
from realizer.facebuild.skin.skin import Skin, distance_through

CAVITY = 1500.0  # part of the light that a metre of depth below the surroundings takes away
AROUND = 6.0  # texels of these surroundings
WET, TEARS = 0.35, 0.14  # roughness of the lining of the mouth, and of the lids' edges


def surface_of(skin: Skin, relief: Relief) -> Float32:
    """Return occlusion, roughness and thickness of the texels, (k, 3) 0..1."""
    return np.stack([_cavities(skin, relief), _roughness(skin), _thickness(skin)], 1)


def _cavities(skin: Skin, relief: Relief) -> Float32:
    below = skin.texels.blurred(relief.rest, AROUND) - relief.rest
    return skin.float(np.clip(1 - CAVITY * np.maximum(below, 0), 0.6, 1))


def _roughness(skin: Skin) -> Float32:
    row = skin.table["roughness"]
    lids = skin.around("3.1", "3.2", "3.3", "3.4", radii=(0.020, 0.010, 0.02))
    out = row["cheek"] + (row["oily"] - row["cheek"]) * skin.oily()
    out = out + (row["lids"] - out) * np.clip(lids, 0, 1) * 0.6
    out = out + 0.06 * skin.look.age
    out = out + row["fine"] * (skin.noise(0.0012, 80) + 0.5 * skin.noise(0.005, 81))
    out = out + (row["lips"] + 0.03 * skin.noise(0.0010, 82, skin.red) - out) * skin.red
    wet = smooth(skin.ring, 2.0, 1.0)
    tears = np.maximum(*skin.margins())
    out = out + (WET - out) * wet
    return skin.float(np.clip(out + (TEARS - out) * tears, 0.12, 1))


def _thickness(skin: Skin) -> Float32:
    full = skin.table["thickness"]["full"]
    part = skin.part
    ups = vertex_normals(part.vertices, part.triangles)
    patch = part.patch
    assert patch is not None
    # No light comes from inside the mouth.
    outside = np.flatnonzero(patch.mix @ (~skin.lips.inside * 1.0) > 0.5)
    through = distance_through(part.vertices, ups, outside, full) / full
    # Behind lids and lips is no air but an eye or teeth.
    ears = skin.around("10.1", "10.2", "10.3", "10.4", "10.7", "10.8", radii=(0.04, 0.04, 0.04))
    wings = skin.around("9.1", "9.2", radii=(0.016, 0.014, 0.016))
    airy = np.clip(2 * np.maximum(ears, wings), 0, 1)
    return skin.float(1 - airy * (1 - np.clip(skin.texels.spread(through), 0, 1)))
