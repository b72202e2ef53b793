"""Tests of the textures of exported heads."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from realizer.face.glb_file import GlbFile
from realizer.face.maps import Maps
from realizer.facebuild.arkit.gltf import Gltf
from realizer.outputs.glb_materials import Look, Materials


def webp(colour: tuple[int, ...], mode: str) -> bytes:
    out = io.BytesIO()
    Image.new(mode, (32, 32), colour).save(out, "WEBP", lossless=True, exact=True)
    return out.getvalue()


def maps_of(**files: bytes) -> Maps:
    none = np.zeros((0, 3, 2), np.float32)
    return Maps(files, none, 0.001, 0.001, none[:, 0, 0] > 0, none[:, 0])


def picture(materials: Materials, file: GlbFile, folder: Path, info: dict[str, int]) -> np.ndarray:
    """Return the picture behind a texture of a material."""
    document = materials.document()
    (folder / "x.glb").write_bytes(file.bytes_of({"asset": {"version": "2.0"}, **document}))
    pixels = Gltf(folder / "x.glb").pixels(document["textures"][info["index"]]["source"])
    return np.asarray(pixels, int)


def test_materials_use_the_maps_as_gltf_names_them(tmp_path: Path) -> None:
    file = GlbFile()
    maps = maps_of(
        albedo=webp((200, 150, 120, 40), "RGBA"), surface=webp((90, 180, 30), "RGB"),
        normal=webp((128, 200, 230), "RGB"),
    )  # fmt: skip
    materials = Materials(file, maps, np.array([[0.5, 0.5], [0.7, 0.9]], np.float32))
    materials.add(Look("skin", 0.8, False, False, True))
    materials.add(Look("hair", 1.0, True, True, True))
    skin, hair = materials.document()["materials"]
    surface = skin["pbrMetallicRoughness"]
    assert (surface["roughnessFactor"], surface["metallicFactor"]) == (0.8, 0)
    seen = {
        name: picture(materials, file, tmp_path, info)
        for name, info in (
            ("colour", surface["baseColorTexture"]), ("rough", surface["metallicRoughnessTexture"]),
            ("shade", skin["occlusionTexture"]), ("normal", skin["normalTexture"]),
            ("cut", hair["pbrMetallicRoughness"]["baseColorTexture"]),
        )
    }  # fmt: skip
    assert seen["colour"][16, 16] == pytest.approx([200, 150, 120, 255], abs=2)
    assert seen["rough"][16, 16, 1] == pytest.approx(180, abs=2)
    assert seen["shade"][16, 16, 0] == pytest.approx(90, abs=2)
    assert seen["normal"][16, 16, :3] == pytest.approx([128, 200, 230], abs=4)
    assert seen["cut"][20, 18].tolist() == [200, 150, 120, 40]
    assert seen["cut"][2, 2].tolist() == [255] * 4
    assert (hair["alphaMode"], hair["alphaCutoff"], hair["doubleSided"]) == ("MASK", 0.5, True)


def test_materials_without_maps_have_no_textures() -> None:
    materials = Materials(GlbFile(), None, np.zeros((0, 2), np.float32))
    assert materials.add(Look("skin", 0.5, False, False, False)) == 0
    assert materials.document() == {
        "materials": [
            {
                "name": "skin",
                "doubleSided": False,
                "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.5},
            }
        ]
    }
