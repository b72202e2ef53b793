"""The drawn mesh of a face as primitives of a glTF file."""

import io
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float32, Int32, UInt8
from realizer.core.colours import linear
from realizer.face.drawn_mesh import NEUTRAL, drawn_mesh
from realizer.face.glb_file import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, GlbFile
from realizer.face.maps import Maps
from realizer.face.model import Face
from realizer.face.surface import normals
from realizer.outputs.morph_targets import MorphTargets
from realizer.render.textures import ALPHA, OCCLUSION, ROUGHNESS, SLOPE_U, SLOPE_V, normals_of, texels_of

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


MIN_NORMAL_CHANGE = 0.01  # half a degree; smaller changes of a normal are invisible
NEGLIGIBLE = 5e-6  # m; smaller movements are omitted from a target
LEVEL = 1e-4  # of u and v: nearer to the neutral square there is nothing of the maps


@dataclass(frozen=True, eq=False)
class _Group:
    """Triangles of one material: their vertices in the drawn mesh (k,), and corners (t, 3) among these."""

    vertices: Any
    triangles: Any
    material: int
    mapped: bool


class GlbMesh:
    """What is drawn of a face, in a file."""

    def __init__(self, file: GlbFile, face: Face) -> None:
        """Prepare; nothing is added to the file."""
        self._file, self._face, self._mesh = file, face, drawn_mesh(face)
        self._at, self._ups = self._drawn(face.vertices)
        cut = np.unique(self._mesh.triangles[self._mesh.see_through])
        self.materials = Materials(file, face.maps, self._mesh.uv[cut])
        # Colours include the baked occlusion, because viewers do not support it by vertex.
        self._colours = linear(self._mesh.colours) * self._mesh.occlusion[:, None]
        self._tangents = tangents(self._at, self._ups, self._mesh.triangles, self._mesh.uv)

    def part(self, name: str) -> Bool:
        """Return which drawn vertices belong to a part, (d,)."""
        mine = np.zeros(len(self._at), bool)
        mine[slice(*self._mesh.parts[name])] = True
        return mine

    def rigid(self, part: Bool, name: str, centre: Float32 | float = 0.0) -> dict[str, Any]:
        """Return the mesh of some vertices at rest.

        Args:
            part: (d,) the vertices; triangles with others are omitted.
            centre: (3,) metres, the origin of the mesh.
        """
        groups = self._groups(part)
        return {"name": name, "primitives": [self._primitive(group, centre) for group in groups]}

    def morphing(self, part: Bool, targets: MorphTargets) -> dict[str, Any]:
        """Return the mesh of some vertices with morph targets, and two joints: 0 is fixed, 1 is the head."""
        groups = self._groups(part)
        primitives = [self._primitive(group, 0.0) for group in groups]
        turning = np.clip(self._mesh.places @ self._face.basis["head"][:, 0], 0, 1)
        for group, primitive in zip(groups, primitives, strict=True):
            shares = np.zeros((len(group.vertices), 4), np.float32)
            shares[:, 1] = turning[group.vertices]
            shares[:, 0] = 1 - shares[:, 1]
            # glTF requires joint 0 for weights of 0.
            joints = (shares > 0) * np.array([0, 1, 0, 0], np.uint8)
            primitive["attributes"]["JOINTS_0"] = self._file.add(joints, target=ARRAY_BUFFER)
            primitive["attributes"]["WEIGHTS_0"] = self._file.add(shares, target=ARRAY_BUFFER)
        mesh = {"name": self._face.name, "primitives": primitives}
        if not targets.names:
            return mesh
        for moves in targets.moves:
            moved, ups = self._drawn(self._face.vertices + moves)
            moved, ups = moved - self._at, ups - self._ups
            moved[np.abs(moved).max(axis=1) < NEGLIGIBLE] = 0
            ups[np.abs(ups).max(axis=1) < MIN_NORMAL_CHANGE] = 0
            for group, primitive in zip(groups, primitives, strict=True):
                found = moved[group.vertices], ups[group.vertices]
                target = {
                    "POSITION": self._file.add_sparse(found[0], bounds=True),
                    "NORMAL": self._file.add_sparse(found[1]),
                }
                primitive.setdefault("targets", []).append(target)
        # The usual place for names of targets, which glTF does not define.
        return mesh | {"weights": [0.0] * len(targets.names), "extras": {"targetNames": list(targets.names)}}

    def _drawn(self, vertices: Float32) -> tuple[Float32, Float32]:
        """Return drawn vertices and normals, (d, 3) each."""
        own = normals(self._face, vertices[None])[0]
        at, ups = self._mesh(vertices, own, np.zeros(len(own), np.float32))
        return np.asarray(at, np.float32), np.ascontiguousarray(ups[:, :3], np.float32)

    def _groups(self, part: Bool) -> list[_Group]:
        """Return the triangles of some vertices by their part, and by how they are drawn."""
        mesh, found = self._mesh, []
        inside = part[mesh.triangles].all(axis=1)
        level = (np.abs(mesh.uv - NEUTRAL) < LEVEL).all(axis=1)
        mapped = np.asarray(~level[mesh.triangles].all(axis=1) & (self._face.maps is not None))
        for name, (first, last) in mesh.parts.items():
            own = inside & (mesh.triangles[:, 0] >= first) & (mesh.triangles[:, 0] < last)
            for cut, lies in product((False, True), repeat=2):
                mine = own & (mesh.see_through == cut) & (mapped == lies)
                if not mine.any():
                    continue
                vertices, corners = np.unique(mesh.triangles[mine], return_inverse=True)
                some_cut = "_cut" * (cut and not mesh.see_through[own].all())
                some_mapped = "_mapped" * (lies and not mapped[own].all())
                look = Look(
                    name + some_cut + some_mapped,
                    float(mesh.roughness[vertices].mean()),
                    bool(mesh.two_sided[mine].any()), cut, lies,
                )  # fmt: skip
                material = self.materials.add(look)
                found.append(_Group(vertices, corners.reshape(-1, 3), material, lies))
        return found

    def _primitive(self, group: _Group, centre: Float32 | float) -> dict[str, Any]:
        mine, add = group.vertices, self._file.add
        attributes = {
            "POSITION": add(self._at[mine] - np.float32(centre), target=ARRAY_BUFFER, bounds=True),
            "NORMAL": add(self._ups[mine], target=ARRAY_BUFFER),
            "COLOR_0": self._file.add_colours(self._colours[mine]),
        }
        if group.mapped:
            attributes["TEXCOORD_0"] = add(self._mesh.uv[mine], target=ARRAY_BUFFER)
            if self.materials.bumpy:
                attributes["TANGENT"] = add(self._tangents[mine], target=ARRAY_BUFFER)
        return {
            "attributes": attributes,
            "indices": add(group.triangles.astype(np.uint32).ravel(), target=ELEMENT_ARRAY_BUFFER),
            "material": group.material,
        }


def tangents(at: Float32, ups: Float32, triangles: Int32, uv: Float32) -> Float32:
    """Return glTF's tangents (d, 4): the way of rising u, and 1, or -1 where the map is mirrored."""
    a, b, c = (at[triangles[:, k]].astype(np.float64) for k in range(3))
    p, q, r = (uv[triangles[:, k]].astype(np.float64) for k in range(3))
    (pu, pv), (qu, qv) = (q - p).T, (r - p).T
    area = pu * qv - qu * pv
    along = ((b - a) * qv[:, None] - (c - a) * pv[:, None]) * np.sign(area)[:, None]
    sums = np.zeros((len(at), 4))
    for k in range(3):
        for axis in range(3):
            sums[:, axis] += np.bincount(triangles[:, k], along[:, axis], len(at))
        sums[:, 3] += np.bincount(triangles[:, k], area, len(at))
    ups = ups.astype(np.float64)
    # Any way across the normal where the map has none.
    spare = np.cross(ups, np.where(np.abs(ups[:, :1]) < 0.9, (1.0, 0, 0), (0, 1.0, 0)))
    out = np.empty((len(at), 4))
    out[:, :3] = sums[:, :3] - ups * (ups * sums[:, :3]).sum(axis=1, keepdims=True)
    size = np.linalg.norm(out[:, :3], axis=1)
    out[size < 1e-9, :3] = spare[size < 1e-9]
    out[:, :3] /= np.linalg.norm(out[:, :3], axis=1, keepdims=True)
    # v goes down, counter-clockwise triangles of an upright map have a negative area in it.
    out[:, 3] = np.where(sums[:, 3] > 0, -1, 1)
    return out.astype(np.float32)
