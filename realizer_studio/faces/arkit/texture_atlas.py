"""The texture atlas of an imported head: the maps of a face from the textures of its materials."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from PIL import Image
from scipy.ndimage import distance_transform_edt

from realizer.core.array_types import Bool, Float64
from realizer.core.colours import linear, srgb
from realizer.core.errors import FaceError
from realizer.face.drawn_mesh import GLOSSY
from realizer_studio.faces.arkit.gltf import Gltf
from realizer_studio.faces.arkit.materials import CLAMP, MIRROR, Material
from realizer_studio.faces.arkit.mesh_merge import Surface

# Larger sources are reduced: a head in a picture of a thousand pixels needs fewer texels than that, and
# maps of 4096 x 4096 texels take four times the memory and time of loading.
SIZE = 2048
PAD = 8  # texels of padding around each patch, for filtering
NEUTRAL = 16  # texels of the neutral square at the top left
LEAST = 8  # texels of a patch of one colour
SHRINK = 0.94  # factor by which patches are reduced until all fit
COARSEST = 0.01  # of the size of the sources
LARGEST = 8192  # texels of a source that are read along one axis
# The resolution of a part's textures relative to the skin's, if not all fit.
FINENESS = {"hair": 0.7, "beard": 0.7, "upper_teeth": 0.7, "lower_teeth": 0.7, "shirt": 0.4, "other": 0.4}
QUALITY = {"albedo": 92, "normal": 95, "surface": 92}  # of WebP: 1 to 4 MB together


@dataclass(frozen=True, eq=False)
class Atlas:
    """The maps of a head."""

    files: Mapping[str, bytes]  # name of a map, as in `face.maps.NAMES` -> WebP
    uv: Any  # (m, 3, 2) uint16
    see_through: Bool  # (m,), as in `face.maps.Maps`
    gloss: Float64  # (m,) of the triangles' materials, as in `Face.gloss`; NaN where the file says nothing


@dataclass(frozen=True, eq=False)
class _Patch:
    material: Material
    rows: Any  # triangles
    uv: Float64  # of their corners, moved to one copy of a repeating texture
    low: Float64  # the least u and v
    span: Float64  # their ranges
    texels: Float64  # width and height in the source
    fineness: float


def make_atlas(gltf: Gltf, surface: Surface, ranges: Mapping[str, tuple[int, int]]) -> Atlas | None:
    """Return the maps of a surface, or None if it has no textures.

    Raises:
        FaceError: an image is missing or too large.
    """
    if not any(surface.materials[k].textures for k in np.unique(surface.material)):
        return None
    # Materials that differ only by name and roughness share a patch.
    materials: dict[Material, list[int]] = {}
    for k in np.unique(surface.material).tolist():
        materials.setdefault(replace(surface.materials[k], name="", roughness=None), []).append(k)
    patches = [_patch(gltf, surface, material, of, ranges) for material, of in materials.items()]
    share = 1 / min(FINENESS.values())  # the resolution of the file
    while (corners := pack(sizes := [_size(patch, share) for patch in patches])) is None:
        share *= SHRINK
        if share < COARSEST:
            raise FaceError(f"{gltf.path}: wanted room for {len(patches)} materials; join some of them")
    maps = {
        "albedo": np.full((SIZE, SIZE, 4), 255, np.uint8),
        "normal": np.full((SIZE, SIZE, 3), (128, 128, 255), np.uint8),
        "surface": np.full((SIZE, SIZE, 3), 255, np.uint8),
    }
    free = np.ones((SIZE, SIZE), bool)
    free[: NEUTRAL + PAD, : NEUTRAL + PAD] = False
    uv = np.empty_like(surface.uv)
    holes = np.zeros(len(uv), bool)
    for patch, size, (x, y) in zip(patches, sizes, corners, strict=True):
        inner = np.array(size) - 2 * PAD
        uv[patch.rows] = (np.array((x, y)) + PAD + (patch.uv - patch.low) / patch.span * inner) / SIZE
        texel = patch.span / inner
        box = np.concatenate([patch.low - PAD * texel, patch.low + patch.span + PAD * texel])
        for name, picture in _painted(gltf, patch.material, box, size).items():
            maps[name][y : y + size[1], x : x + size[0]] = picture
        free[y : y + size[1], x : x + size[0]] = False
        holes[patch.rows] = maps["albedo"][y : y + size[1], x : x + size[0], 3].min() < 250
    # Free texels get the colour of the nearest patch, because mipmaps mix neighbours.
    near = distance_transform_edt(free, return_distances=False, return_indices=True)
    maps["albedo"] = maps["albedo"][tuple(near)]
    slots = {slot for patch in patches for slot, _ in patch.material.textures}
    if "normal" not in slots:
        del maps["normal"]
    if not slots & {"roughness", "occlusion"}:
        del maps["surface"]
    files = {name: _webp(picture, QUALITY[name]) for name, picture in maps.items()}
    rough = [np.nan if one.roughness is None else one.roughness for one in surface.materials]
    gloss = np.clip((1 - np.array(rough)) / GLOSSY, 0, 1)[surface.material]
    return Atlas(files, np.rint(uv * 65535).clip(0, 65535).astype(np.uint16), holes, gloss)


def pack(sizes: Sequence[tuple[int, int]]) -> list[tuple[int, int]] | None:
    """Return the left and upper corner of each patch (width, height) in the atlas, or None."""
    floor = np.zeros(SIZE, int)  # the first free row of each column
    floor[: NEUTRAL + PAD] = NEUTRAL + PAD
    corners: list[tuple[int, int]] = [(0, 0)] * len(sizes)
    for k in sorted(range(len(sizes)), key=lambda k: sizes[k][::-1], reverse=True):
        width, height = sizes[k]
        if width > SIZE:
            return None
        tops = np.lib.stride_tricks.sliding_window_view(floor, width).max(axis=1)
        x = int(np.argmin(tops))
        y = int(tops[x])
        if y + height > SIZE:
            return None
        floor[x : x + width] = y + height
        corners[k] = x, y
    return corners


def _patch(
    gltf: Gltf, surface: Surface, material: Material, of: list[int], ranges: Mapping[str, tuple[int, int]]
) -> _Patch:
    """Return the patch of the triangles of equivalent materials."""
    rows = np.flatnonzero(np.isin(surface.material, of))
    uv = surface.uv[rows]
    for axis, wrap in enumerate(material.chart.wrap):
        period = {CLAMP: 0, MIRROR: 2}.get(wrap, 1)
        if period:
            uv[..., axis] -= np.floor(uv[..., axis].mean(axis=1, keepdims=True) / period) * period
    texels = np.ones(2)
    for _, texture in material.textures:
        pixels = gltf.pixels(texture.image)
        if pixels is not None:
            texels = np.maximum(texels, pixels.shape[1::-1])
    low = uv.min(axis=(0, 1))
    span = np.maximum(uv.max(axis=(0, 1)) - low, 1 / texels)
    corners = surface.triangles[rows, 0]
    inside = [name for name, (first, last) in ranges.items() if ((corners >= first) & (corners < last)).any()]
    fineness = max((FINENESS.get(name, 1.0) for name in inside), default=1.0)
    return _Patch(material, rows, uv, low, span, span * texels, fineness)


def _size(patch: _Patch, share: float) -> tuple[int, int]:
    """Return width and height of a patch in the atlas, including its padding."""
    scale = min(1.0, share * patch.fineness, (SIZE - 2 * PAD) / patch.texels.max())
    width, height = np.maximum(np.ceil(patch.texels * scale), LEAST) + 2 * PAD
    return int(width), int(height)


def _painted(gltf: Gltf, material: Material, box: Float64, size: tuple[int, int]) -> dict[str, Any]:
    """Return the maps of one material, each (height, width, channels) uint8.

    Args:
        box: u, v of the upper left corner, u, v of the lower right one.
    """
    textures = dict(material.textures)

    def sampled(slot: str, cut: Any = None) -> Any:
        """Return the texture of a slot as 0..255, or None."""
        texture = textures.get(slot)
        pixels = gltf.pixels(texture.image) if texture else None
        if texture is None or pixels is None:
            return None
        return _resampled(cut(pixels) if cut else pixels, box, size, texture.chart.wrap).astype(np.float32)

    factor = material.colour[3]

    def with_alpha(pixels: Any) -> Any:
        """Apply the material's alpha mode."""
        if material.alpha == "OPAQUE":
            return pixels[..., :3]
        if material.alpha == "MASK":
            solid = pixels[..., 3:] * factor >= 255 * material.cutoff
            return np.concatenate([pixels[..., :3], 255 * solid.astype(np.uint8)], axis=2)
        return pixels

    base = sampled("base", with_alpha)
    albedo = np.full((size[1], size[0], 4), 255, np.float32)
    if base is not None:
        albedo[..., : base.shape[2]] = base
    if material.alpha == "BLEND":
        albedo[..., 3] *= factor
    light = linear(albedo[..., :3]) * np.array(material.colour[:3], np.float32)
    if any(material.emission):
        glow = sampled("emission")
        light = light + (1 if glow is None else linear(glow[..., :3])) * np.array(
            material.emission, np.float32
        )
    albedo[..., :3] = srgb(light) * 255
    out = {"albedo": albedo}
    if (normal := sampled("normal")) is not None:
        normals = normal[..., :3] / 127.5 - 1
        normals[..., :2] *= textures["normal"].amount
        normals /= np.maximum(np.linalg.norm(normals, axis=2, keepdims=True), 1e-6)
        out["normal"] = 127.5 * normals + 127.5
    out["surface"] = np.full((size[1], size[0], 3), 255, np.float32)
    if (shade := sampled("occlusion")) is not None:
        out["surface"][..., 0] -= (255 - shade[..., 0]) * textures["occlusion"].amount
    if (rough := sampled("roughness")) is not None:
        out["surface"][..., 1] = rough[..., 1]
    return {name: np.clip(np.rint(picture), 0, 255).astype(np.uint8) for name, picture in out.items()}


def _resampled(pixels: Any, box: Float64, size: tuple[int, int], wrap: tuple[int, int]) -> Any:
    """Return the part of a texture in a box of u and v as (height, width, channels)."""
    height, width = pixels.shape[:2]
    low, high = box[:2] * (width, height), box[2:] * (width, height)
    first, step, axes = np.floor(low), np.ones(2), []
    for axis, n in enumerate((width, height)):
        count = np.ceil(high[axis]) - first[axis]
        step[axis] = max(1.0, count / LARGEST)
        index = (first[axis] + step[axis] * np.arange(int(count / step[axis]))).astype(int)
        if wrap[axis] == CLAMP:
            index = index.clip(0, n - 1)
        elif wrap[axis] == MIRROR:
            index = np.where(index // n % 2 == 0, index % n, n - 1 - index % n)
        axes.append(index % n)
    part = pixels[axes[1][:, None], axes[0]]
    frame = (*((low - first) / step), *((high - first) / step))
    # Channels are resized separately, because Pillow premultiplies by alpha.
    return np.stack(
        [
            np.asarray(Image.fromarray(part[..., k]).resize(size, Image.Resampling.BICUBIC, frame))
            for k in range(part.shape[2])
        ],
        axis=2,
    )


def _webp(picture: Any, quality: int) -> bytes:
    out = io.BytesIO()
    Image.fromarray(picture).save(out, "WEBP", quality=quality, method=4, exact=True)
    return out.getvalue()
