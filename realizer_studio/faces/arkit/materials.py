"""The materials of a glTF file: factors and textures."""

from dataclasses import dataclass
from typing import Any

from realizer_studio.faces.arkit.gltf import Gltf

REPEAT, CLAMP, MIRROR = 10497, 33071, 33648
DRAWN = {  # extensions of materials that the import supports
    "KHR_materials_unlit", "KHR_materials_pbrSpecularGlossiness", "KHR_materials_emissive_strength",
    "KHR_materials_transmission",
}  # fmt: skip


@dataclass(frozen=True)
class Chart:
    """The texture coordinates of a texture."""

    name: str = ""  # the attribute, such as TEXCOORD_0
    offset: tuple[float, float] = (0, 0)  # as in KHR_texture_transform
    scale: tuple[float, float] = (1, 1)  # as in KHR_texture_transform
    rotation: float = 0  # as in KHR_texture_transform
    # Wrapping beyond the edges of the texture along u and v: REPEAT, CLAMP or MIRROR.
    wrap: tuple[int, int] = (REPEAT, REPEAT)


@dataclass(frozen=True)
class Texture:
    """A texture of a file: the number of its image, its coordinates, and its strength."""

    image: int
    chart: Chart
    amount: float = 1.0


@dataclass(frozen=True)
class Material:
    """The look of a surface."""

    name: str  # its name, or ""
    colour: tuple[float, ...]  # linear RGB and alpha
    emission: tuple[float, ...]  # linear RGB
    roughness: float | None  # 0..1, or None if the file does not state it
    alpha: str  # OPAQUE, MASK or BLEND
    cutoff: float  # alpha below which MASK is transparent
    transmission: float  # 0..1, share of transmitted light
    textures: tuple[tuple[str, Texture], ...]  # base, normal, roughness, occlusion, emission -> texture

    @property
    def chart(self) -> Chart:
        """The texture coordinates, which are those of the first texture."""
        return self.textures[0][1].chart if self.textures else Chart()


def read_material(gltf: Gltf, number: int | None) -> tuple[Material, tuple[str, ...]]:
    """Return a material of a file, and notes about properties that are not drawn; None for glTF's default.

    Raises:
        FaceError: a texture or a sampler is missing.
    """
    found = {} if number is None else gltf.item("materials", number)
    name, more = str(found.get("name", "")), found.get("extensions", {})
    pbr, glossy = found.get("pbrMetallicRoughness", {}), more.get("KHR_materials_pbrSpecularGlossiness", {})
    slots = {
        "base": pbr.get("baseColorTexture") or glossy.get("diffuseTexture"),
        "normal": found.get("normalTexture"),
        "roughness": pbr.get("metallicRoughnessTexture"),
        "occlusion": found.get("occlusionTexture"),
        "emission": found.get("emissiveTexture"),
    }
    kinds = "KHR_materials_", "EXT_materials_"
    notes = [f"{name} is not drawn" for name in more if name.startswith(kinds) and name not in DRAWN]
    if "KHR_materials_unlit" in more:
        notes.append("unlit in the file, here light falls on it as on all others")
    textures: dict[str, Texture] = {}
    for slot, info in slots.items():
        texture = _texture(gltf, info, slot) if info else None
        if texture is None:
            if info:
                notes.append(f"the {slot} texture has no picture that is known")
            continue
        chart = next((one.chart for one in textures.values()), texture.chart)
        if _coordinates(texture.chart) == _coordinates(chart):
            textures[slot] = texture
        else:
            notes.append(f"the {slot} texture has other places than the first one and is left out")
    bright = more.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1)
    material = Material(
        name,
        tuple(glossy.get("diffuseFactor") or pbr.get("baseColorFactor", (1, 1, 1, 1))),
        tuple(bright * factor for factor in found.get("emissiveFactor", (0, 0, 0))),
        pbr.get("roughnessFactor", 1.0 if "roughness" in textures else None),
        found.get("alphaMode", "OPAQUE"),
        found.get("alphaCutoff", 0.5),
        more.get("KHR_materials_transmission", {}).get("transmissionFactor", 0),
        tuple(textures.items()),
    )
    return material, tuple(notes)


def _coordinates(chart: Chart) -> tuple[Any, ...]:
    return chart.name, chart.offset, chart.scale, chart.rotation


def _texture(gltf: Gltf, info: dict[str, Any], slot: str) -> Texture | None:
    found = gltf.item("textures", info["index"])
    more = found.get("extensions", {})
    sources = [found, *(more.get(f"EXT_texture_{kind}", {}) for kind in ("webp", "avif"))]
    sources.append(more.get("KHR_texture_basisu", {}))
    image = next((one["source"] for one in sources if one.get("source") is not None), None)
    if image is None:
        return None
    sampler = gltf.item("samplers", found["sampler"]) if found.get("sampler") is not None else {}
    move = info.get("extensions", {}).get("KHR_texture_transform", {})
    chart = Chart(
        f"TEXCOORD_{move.get('texCoord', info.get('texCoord', 0))}",
        tuple(move.get("offset", (0, 0))), tuple(move.get("scale", (1, 1))), move.get("rotation", 0),
        (sampler.get("wrapS", REPEAT), sampler.get("wrapT", REPEAT)),
    )  # fmt: skip
    return Texture(image, chart, info.get({"normal": "scale", "occlusion": "strength"}.get(slot, ""), 1.0))
