"""The materials of an exported head, with the face's maps as textures that every glTF reader knows."""

import io
from dataclasses import dataclass
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, UInt8
from realizer.face.glb_file import GlbFile
from realizer.face.maps import Maps
from realizer.render.normal_map import normals_of
from realizer.render.textures import ALPHA, OCCLUSION, ROUGHNESS, SLOPE_U, SLOPE_V, texels_of

QUALITY = {"colour": 92, "normal": 95, "surface": 90}  # of JPEG
MARGIN = 4  # texels
CUTOFF = 0.5  # alpha below which nothing is drawn


@dataclass(frozen=True)
class Look:
    """What a material is like.

    Attributes:
        roughness: 0..1, multiplied with the map's.
        sheet: whether it is seen from both sides; cut: whether the map's alpha cuts holes into it.
        mapped: whether it lies in the maps.
    """

    name: str
    roughness: float
    sheet: bool
    cut: bool
    mapped: bool


class Materials:
    """The materials, textures and pictures of a document.

    Attributes:
        bumpy: whether mapped materials have a normal map, which needs tangents.
    """

    def __init__(self, file: GlbFile, maps: Maps | None, holes: Float32) -> None:
        """Prepare; pictures are added to the file when a material needs them.

        Args:
            holes: (n, 2) places in the maps of all vertices of triangles with holes.
        """
        self._file, self._maps, self._holes = file, maps, holes
        self.bumpy = maps is not None and not {"relief", "normal"}.isdisjoint(maps.files)
        self._texels: Any = None
        self._textures: dict[str, int] = {}
        self._found: list[dict[str, Any]] = []
        self._images: list[dict[str, Any]] = []

    def add(self, look: Look) -> int:
        """Return the number of a new material."""
        surface: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": round(look.roughness, 3)}
        material = {"name": look.name, "doubleSided": look.sheet, "pbrMetallicRoughness": surface}
        if look.mapped:
            surface["baseColorTexture"] = self._texture("cut" if look.cut else "colour")
            if self.bumpy:
                material["normalTexture"] = self._texture("normal")
            if self._maps is not None and "surface" in self._maps.files:
                surface["metallicRoughnessTexture"] = self._texture("surface")
                material["occlusionTexture"] = self._texture("surface")
        if look.cut:
            material |= {"alphaMode": "MASK", "alphaCutoff": CUTOFF}
        self._found.append(material)
        return len(self._found) - 1

    def document(self) -> dict[str, Any]:
        """Return the materials, textures and images of the document."""
        out: dict[str, Any] = {"materials": self._found}
        if self._images:
            out["images"] = self._images
            out["textures"] = [{"source": k} for k in range(len(self._images))]
        return out

    def _texture(self, name: str) -> dict[str, int]:
        if name not in self._textures:
            form = "PNG" if name == "cut" else "JPEG"
            view = self._file.add_bytes(_encoded(self._picture(name), form, QUALITY.get(name, 0)))
            self._textures[name] = len(self._images)
            self._images.append({"name": name, "bufferView": view, "mimeType": f"image/{form.lower()}"})
        return {"index": self._textures[name]}

    def _picture(self, name: str) -> UInt8:
        if self._texels is None:
            self._texels = texels_of(self._maps)
        fine = self._texels.level(0)
        if name == "cut":  # the rest in one colour, which PNG makes small
            picture = np.full((*fine.shape[:2], 4), 255, np.uint8)
            size = fine.shape[1::-1]
            low = np.maximum(np.floor(self._holes.min(axis=0) * size).astype(int) - MARGIN, 0)
            high = np.ceil(self._holes.max(axis=0) * size).astype(int) + MARGIN
            box = slice(low[1], high[1]), slice(low[0], high[0])
            picture[box] = fine[box][..., : ALPHA + 1]
            return picture
        if name == "normal":
            return normals_of(fine[..., SLOPE_U : SLOPE_V + 1])
        if name == "surface":
            picture = np.zeros((*fine.shape[:2], 3), np.uint8)  # blue is metal
            picture[..., :2] = fine[..., [OCCLUSION, ROUGHNESS]]
            return picture
        return np.ascontiguousarray(fine[..., :ALPHA])


def _encoded(picture: UInt8, form: str, quality: int) -> bytes:
    from PIL import Image

    out = io.BytesIO()
    how: dict[str, Any] = {"optimize": False} if form == "PNG" else {"quality": quality, "subsampling": 0}
    Image.fromarray(picture).save(out, form, **how)
    return out.getvalue()
