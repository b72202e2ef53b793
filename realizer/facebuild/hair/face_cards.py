"""All cards of a face: hair, brows, lashes and beard, and the file that holds them."""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.face.cards import FILE, Cards
from realizer.face.mesh_geometry import part_triangles
from realizer.face.model import Face
from realizer.face.subdivision import subdivided
from realizer.facebuild.face_files import to_bytes
from realizer.facebuild.hair.beard import COUNT, beard
from realizer.facebuild.hair.bind import bind
from realizer.facebuild.hair.brows import brow
from realizer.facebuild.hair.cards import Patch, joined
from realizer.facebuild.hair.grow import hair, tints
from realizer.facebuild.hair.lashes import Margin, lashes
from realizer.facebuild.hair.style import style_of
from realizer.facebuild.inside import depths, without_rim
from realizer.facebuild.person.recipe import Recipe, appearance_of
from realizer.facebuild.person.scalp import Scalp

DEEP, OFF = 0.012, 0.0002  # m under the skin that hair is looked for, and above it that it is put


def face_cards(face: Face, recipe: Recipe, margins: Sequence[Margin], bearded: Float64) -> Cards:
    """Return the cards of a face that was built without them.

    Args:
        margins: the edges of the lids.
        bearded: (n,) 0..1, where a beard grows on the skin.
    """
    look, colours = appearance_of(recipe.look), recipe.colours
    points = {name: np.array(place, float) for name, place in face.points.items()}
    at, fine = face.vertices.astype(float), subdivided(face).face
    skin = at, face.triangles[(face.triangles < face.parts["skin"][1]).all(axis=1)]
    first, last = fine.parts["skin"]
    drawn = fine.vertices[first:last].astype(float), part_triangles(fine.triangles, (first, last))
    style = style_of(recipe.hair)
    scalp = Scalp(*drawn, points, style.line, style.rise)
    rng = np.random.default_rng(zlib.crc32(face.name.encode()))
    groups = {
        "hair": [hair(scalp, drawn[1], style, colours["hair"], rng)],
        "brows": [brow(skin, drawn, points, side, colours["brows"], look, rng) for side in (1, -1)],
        "lashes": [lashes(at, margin, colours["lashes"], look.lash, rng) for margin in margins],
    }
    if look.beard:
        tint = tints(style, colours["hair"], COUNT, rng)
        groups["beard"] = [beard(skin, scalp, bearded, points, look.beard, tint, rng)]
    patches = {name: joined(group) for name, group in groups.items()}
    patches |= {name: _lifted(patches[name], *drawn) for name in ("hair", "beard") if name in patches}
    if look.beard:
        patches["beard"] = _lying(patches["beard"], skin[0][: face.parts["skin"][1]])
    ends = np.cumsum([0] + [len(patch.places) for patch in patches.values()]).tolist()
    parts = dict(zip(patches, pairwise(ends), strict=True))
    turns = face.basis["head"][:, 0]
    return bind(joined(list(patches.values())), at, face.triangles, scalp, turns, parts)


def _lifted(patch: Patch, at: Float64, triangles: Int32) -> Patch:
    """Return the patch with what lies in the skin lifted off it."""
    depth, out = depths(patch.places, at, without_rim(triangles), DEEP)
    deep = np.maximum(depth, 0)[:, None]
    far = np.maximum(np.linalg.norm(out, axis=1), 1e-9)[:, None]
    return replace(patch, places=patch.places + (depth > 0)[:, None] * out * (deep + OFF) / far)


def _lying(patch: Patch, at: Float64) -> Patch:
    """Return the patch with vertices that follow the skin (n, 3) below them, not that at their roots."""
    from scipy.spatial import cKDTree

    off, near = (np.asarray(found) for found in cKDTree(at).query(patch.places, 3))
    shares = 1 / (off + OFF)
    return replace(patch, skin=near.astype(np.int32), shares=shares / shares.sum(axis=1, keepdims=True))


def write_cards(folder: Path, cards: Cards) -> None:
    """Write cards.npz, and the parts of the cards to the end of face.toml."""
    np.savez_compressed(
        folder / FILE,
        roots=cards.roots,
        weights=cards.weights,
        ups=cards.ups,
        triangles=cards.triangles,
        uv=np.rint(cards.uv * 65535).astype(np.uint16),
        colours=cards.colours,
        occlusion=to_bytes(cards.occlusion * 255),
        gloss=to_bytes(cards.gloss * 255),
    )
    lines = ["", "[cards]  # first vertex, last + 1"]
    lines += [f"{name} = [{first}, {last}]" for name, (first, last) in cards.parts.items()]
    with (folder / "face.toml").open("a", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")
