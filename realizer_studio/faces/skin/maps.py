"""The baking of a face's maps, and their writer."""

import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from realizer.core.array_types import Float32, Float64, UInt8
from realizer.face.mesh_geometry import vertex_normals
from realizer_studio.faces.face_files import to_bytes
from realizer_studio.faces.hair.cards import hair_texture
from realizer_studio.faces.parts import Part
from realizer_studio.faces.person.lids import Lid
from realizer_studio.faces.person.lips import Lips
from realizer_studio.faces.person.person import Person
from realizer_studio.faces.person.recipe import Recipe
from realizer_studio.faces.skin import skin_atlas
from realizer_studio.faces.skin.albedo import paint_albedo
from realizer_studio.faces.skin.eye_picture import eye_picture
from realizer_studio.faces.skin.lines import lines_of, regions, weights
from realizer_studio.faces.skin.relief import relief_of, surface_of
from realizer_studio.faces.skin.skin import Skin
from realizer_studio.faces.skin.texels import Texels

RELIEF = 0.0012  # m; height of 255 steps of the relief
TEXEL = 0.0002  # m, of a texel in the face
QUALITY = {"albedo": 84, "relief": 90, "surface": 78, "folds": 84}  # of WebP, 0..100


@dataclass(frozen=True, eq=False)
class SkinMaps:
    """The maps of a face, and the texture coordinates of its skin."""

    # Albedo (s, s, 4), relief (s, s), surface (s, s, 3) and folds (s, s), as in a face folder.
    pictures: Mapping[str, UInt8]
    corners: Float64  # (m, 3, 2) texture coordinates, 0..1, of the corners of the skin's triangles
    regions: tuple[str, ...]  # names of the regions of folds
    weights: Float32  # (n, regions) 0..1 of the skin's vertices

    def write(self, folder: Path) -> None:
        """Write the pictures as WebP."""
        for name, picture in self.pictures.items():
            Image.fromarray(picture).save(folder / f"{name}.webp", quality=QUALITY[name], method=4)

    def arrays(self, parts: Sequence[Part]) -> dict[str, Any]:
        """Return the arrays `uv` and `fold_weights` of mesh.npz, for the parts, the skin first."""
        middle = [
            (skin_atlas.NEUTRAL.left + skin_atlas.NEUTRAL.right) / 2,
            (skin_atlas.NEUTRAL.top + skin_atlas.NEUTRAL.bottom) / 2,
        ]
        part_uv = [np.tile(middle, (len(part.vertices), 1)) if part.uv is None else part.uv for part in parts]
        corners = [uv[part.triangles] for uv, part in zip(part_uv[1:], parts[1:], strict=True)]
        uv = np.concatenate([self.corners, *corners])
        folds = np.zeros((sum(len(part.vertices) for part in parts), len(self.regions)))
        folds[: len(self.weights)] = self.weights
        return {"uv": skin_atlas.packed(uv), "fold_weights": to_bytes(255 * folds)}

    def head(self) -> dict[str, Any]:
        """Return the table [maps] of face.toml."""
        return {"relief": RELIEF, "texel": TEXEL, "folds": list(self.regions)}


def bake(
    name: str,
    person: Person,
    lips: Lips,
    lids: list[Lid],
    recipe: Recipe,
    part: Part,
    size: int = skin_atlas.SIZE,
    paint: Callable[[Skin, Float32], Float32] | None = None,
) -> SkinMaps:
    """Bake the maps of a person's skin.

    Args:
        name: the face's name, which seeds its spots, pores and lines.
        part: the skin, with its broad colours.
        size: texels of a side.
        paint: maps the skin and its colours (k, 3), sRGB 0..255, to other colours.
    """
    corners = skin_atlas.corners(person.figure.mesh, part.submesh)
    texels = Texels(part.vertices, part.triangles, corners, size)
    skin = Skin(texels, part, person, lips, lids, recipe, zlib.crc32(name.encode()) % 2**20)
    lines = lines_of(skin)
    relief = relief_of(skin, lines)
    albedo = paint_albedo(skin, relief.pores, relief.lines)
    albedo = albedo if paint is None else paint(skin, albedo)
    surface = surface_of(skin, relief)
    # The renderer computes slopes with one width for all texels.
    step = 255 / RELIEF * np.clip(TEXEL / texels.width, 0.4, 1.5)
    albedo_map = np.dstack([texels.picture(to_bytes(albedo), 255), np.full((size, size), 255, np.uint8)])
    strands = skin_atlas.HAIR.texels(size)
    albedo_map[strands] = hair_texture(strands[0].stop - strands[0].start)
    pictures = {
        "albedo": albedo_map,
        "relief": texels.picture(to_bytes(128 + relief.rest * step), 128),
        "surface": texels.picture(to_bytes(255 * surface), 255),
        "folds": texels.picture(to_bytes(128 + relief.folds * step), 128),
    }
    eye = skin_atlas.EYES.texels(size)
    eye_maps = eye_picture(eye[0].stop - eye[0].start, recipe.colours, skin.seed)
    pictures["albedo"][(*eye, slice(3))], pictures["surface"][eye] = eye_maps
    normals = vertex_normals(part.vertices, part.triangles)
    return SkinMaps(pictures, corners, regions(lines), weights(skin, lines, normals))
