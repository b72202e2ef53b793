"""Tests of the materials of glTF files."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from realizer.core.errors import FaceError
from realizer_studio.faces.arkit.gltf import Gltf
from realizer_studio.faces.arkit.materials import CLAMP, REPEAT, Material, read_material


def read(folder: Path, material: dict[str, Any], **more: Any) -> tuple[Material, tuple[str, ...]]:
    """Read a material of a file with two textures."""
    document = {"asset": {"version": "2.0"}, "materials": [material], "images": [{}, {}],
                "textures": [{"source": 0}, {"source": 1}], **more}  # fmt: skip
    (folder / "m.gltf").write_text(json.dumps(document), "utf-8")
    return read_material(Gltf(folder / "m.gltf"), 0)


def test_read_material_keeps_every_texture(tmp_path: Path) -> None:
    info = {"index": 1}
    pbr = {"baseColorTexture": {"index": 0}, "metallicRoughnessTexture": info, "roughnessFactor": 0.5}
    material, notes = read(
        tmp_path,
        {"pbrMetallicRoughness": pbr, "normalTexture": info | {"scale": 0.3}, "emissiveTexture": info,
         "occlusionTexture": info | {"strength": 0.4}, "emissiveFactor": [1, 0, 0], "alphaMode": "MASK"},
    )  # fmt: skip
    assert notes == ()
    amounts = {slot: texture.amount for slot, texture in material.textures}
    assert amounts == {"base": 1, "normal": 0.3, "roughness": 1, "occlusion": 0.4, "emission": 1}
    assert (material.roughness, material.alpha, material.emission) == (0.5, "MASK", (1, 0, 0))


def test_read_material_reads_pictures_of_extensions(tmp_path: Path) -> None:
    textures = [{"extensions": {"EXT_texture_webp": {"source": 1}}, "sampler": 0}]
    material, _ = read(
        tmp_path, {"extensions": {"KHR_materials_pbrSpecularGlossiness": {"diffuseTexture": {"index": 0}}}},
        textures=textures, samplers=[{"wrapS": CLAMP}],
    )  # fmt: skip
    assert dict(material.textures)["base"].image == 1
    assert material.chart.wrap == (CLAMP, REPEAT)


def test_read_material_says_what_is_not_drawn(tmp_path: Path) -> None:
    _, notes = read(
        tmp_path,
        {"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}},
         "normalTexture": {"index": 1, "texCoord": 1},
         "extensions": {"KHR_materials_clearcoat": {}, "KHR_materials_unlit": {}}},
    )  # fmt: skip
    assert notes == (
        "KHR_materials_clearcoat is not drawn",
        "unlit in the file, here light falls on it as on all others",
        "the normal texture has other places than the first one and is left out",
    )


def test_read_material_says_that_a_texture_has_no_picture(tmp_path: Path) -> None:
    material, notes = read(tmp_path, {"normalTexture": {"index": 0}}, textures=[{}])
    assert (material.textures, notes) == ((), ("the normal texture has no picture that is known",))


def test_read_material_without_a_number_is_the_usual_one(tmp_path: Path) -> None:
    (tmp_path / "m.gltf").write_text('{"asset": {"version": "2.0"}}', "utf-8")
    material, _ = read_material(Gltf(tmp_path / "m.gltf"), None)
    assert (material.colour, material.roughness, material.textures) == ((1, 1, 1, 1), None, ())


def test_read_material_refuses_a_texture_that_is_missing(tmp_path: Path) -> None:
    with pytest.raises(FaceError, match=r"textures: wanted an index 0\.\.1, got 7"):
        read(tmp_path, {"normalTexture": {"index": 7}})
