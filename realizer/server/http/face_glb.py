"""What is drawn of a face as a binary glTF 2.0 file: mesh, maps, and how it follows a stream of vertices."""

from collections.abc import Iterator, Mapping
from dataclasses import asdict
from typing import Any

import numpy as np

from realizer.core.array_types import Bool
from realizer.core.colours import linear
from realizer.face.drawn_mesh import DrawnMesh, drawn_mesh
from realizer.face.glb_file import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, GlbFile
from realizer.face.model import Face
from realizer.face.surface import face_scale, normals
from realizer.outputs.glb_mesh import tangents
from realizer.render.folds import Folds
from realizer.render.textures import FULL, normal_map

WEBP = "EXT_texture_webp"
MIPMAPS, LINEAR, CLAMP = 9987, 9729, 33071  # of samplers
KIND_NAMES = ("skin", "eye", "hair", "wet", "cloth")  # in the order of `DrawnMesh.kind`


def face_glb(face: Face) -> bytes:
    """Return the face at rest as GLB, with a primitive and a material for each kind of surface.

    All primitives share POSITION, NORMAL, COLOR_0 (linear, as glTF asks), _OCCLUSION and _ROUGHNESS, and, if
    the face has maps, TEXCOORD_0 and TANGENT. A material's `extras.kind` is its row in `surfaces.toml`. The
    mesh's `extras` hold what a client needs for streamed vertices: their number, scale and offset, the matrix
    that makes the drawn vertices of them (`rows`, `columns`, `weights`: accessors of its compressed rows) and
    the one for normals (`normal_rows` ...), `relief` and `folds` if the face has some, parts (name -> first
    and last + 1 drawn vertex), FAPU in metres, source and licence.

    Raises:
        FaceError: a map is no picture.
    """
    mesh, file = drawn_mesh(face), GlbFile()
    own = normals(face, face.vertices[None])[0]
    places, ups = mesh(face.vertices, own, np.zeros(len(own), np.float32))
    ups = np.ascontiguousarray(ups[:, :3])
    attributes = {
        "POSITION": file.add(places.astype(np.float32), target=ARRAY_BUFFER, bounds=True),
        "NORMAL": file.add(ups, target=ARRAY_BUFFER),
        "COLOR_0": file.add_colours(linear(mesh.colours)),
        "_OCCLUSION": file.add(mesh.occlusion.astype(np.float32), target=ARRAY_BUFFER),
        "_ROUGHNESS": file.add(mesh.roughness, target=ARRAY_BUFFER),
    }
    pictures: dict[str, bytes] = {}
    if face.maps:
        attributes["TEXCOORD_0"] = file.add(mesh.uv, target=ARRAY_BUFFER)
        attributes["TANGENT"] = file.add(tangents(places, ups, mesh.triangles, mesh.uv), target=ARRAY_BUFFER)
        normal = normal_map(face.maps)
        pictures = {**face.maps.files, **({"normal": normal} if normal else {})}
    textures = {name: number for number, name in enumerate(pictures)}
    primitives: list[dict[str, Any]] = []
    materials: list[dict[str, Any]] = []
    for kind, holes, sheet, mine in _groups(mesh):
        indices = file.add(mesh.triangles[mine].astype(np.uint32).ravel(), target=ELEMENT_ARRAY_BUFFER)
        primitives.append(
            {"attributes": attributes, "indices": indices, "material": len(materials), "mode": 4}
        )
        rough = float(mesh.roughness[np.unique(mesh.triangles[mine])].mean())
        materials.append(_material(kind, holes, sheet, rough, textures))
    scale, offset = face_scale(face)
    extras = {
        "vertices": len(face.vertices),
        "scale": scale,
        "offset": [float(x) for x in offset],
        **_matrix(file, "", mesh.places),
        **_matrix(file, "normal_", mesh.ups),
        **_heights(file, face, textures),
        "parts": {name: {"vertices": list(ends)} for name, ends in mesh.parts.items()},
        "fapu": asdict(face.fapu),
        "source": face.source,
        "licence": face.licence,
    }
    rights = f"{face.licence}; {face.source}"
    return file.bytes_of(
        {
            "asset": {"version": "2.0", "generator": "bml-realizer", "copyright": rights},
            "scene": 0,
            "scenes": [{"nodes": [0]}],
            "nodes": [{"name": face.name, "mesh": 0}],
            "materials": materials,
            "meshes": [{"name": face.name, "primitives": primitives, "extras": extras}],
            **_textures(file, pictures),
        }
    )


def _textures(file: GlbFile, pictures: Mapping[str, bytes]) -> dict[str, Any]:
    if not pictures:
        return {}
    views = {name: file.add_bytes(webp) for name, webp in pictures.items()}
    return {
        "extensionsUsed": [WEBP],
        "extensionsRequired": [WEBP],
        "images": [
            {"name": name, "bufferView": view, "mimeType": "image/webp"} for name, view in views.items()
        ],
        "samplers": [{"minFilter": MIPMAPS, "magFilter": LINEAR, "wrapS": CLAMP, "wrapT": CLAMP}],
        "textures": [{"sampler": 0, "extensions": {WEBP: {"source": k}}} for k in range(len(views))],
    }


def _groups(mesh: DrawnMesh) -> Iterator[tuple[int, bool, bool, Bool]]:
    """Yield kinds of surfaces, whether they have holes and are sheets, and their triangles (t,)."""
    sort = (mesh.kind[mesh.triangles[:, 0]] << 2) | (mesh.see_through << 1) | mesh.two_sided
    for key in np.unique(sort):
        yield int(key >> 2), bool(key & 2), bool(key & 1), sort == key


def _material(kind: int, holes: bool, sheet: bool, rough: float, textures: dict[str, int]) -> dict[str, Any]:
    """Return a glTF material; one with holes is drawn where alpha is above a half."""
    look: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": round(rough, 4)}
    found: dict[str, Any] = {"name": KIND_NAMES[kind], "pbrMetallicRoughness": look, "extras": {"kind": kind}}
    if sheet:
        found["doubleSided"] = True
    if holes:
        found |= {"name": f"{KIND_NAMES[kind]}_cards", "alphaMode": "MASK"}
    if "albedo" in textures:
        look["baseColorTexture"] = {"index": textures["albedo"]}
    if "normal" in textures:
        found["normalTexture"] = {"index": textures["normal"]}
    if "surface" in textures:  # without metal, its blue channel (thickness) counts only for us
        look["metallicRoughnessTexture"] = {"index": textures["surface"]}
        found["occlusionTexture"] = {"index": textures["surface"]}
    return found


def _matrix(file: GlbFile, prefix: str, matrix: Any) -> dict[str, int]:
    """Add a sparse matrix by rows: the entries of row r are those from rows[r] to rows[r + 1]."""
    narrow = np.uint16 if matrix.shape[1] <= 65536 else np.uint32
    return {
        f"{prefix}rows": file.add(matrix.indptr.astype(np.uint32)),
        f"{prefix}columns": file.add(matrix.indices.astype(narrow)),
        f"{prefix}weights": file.add(matrix.data.astype(np.float32)),
    }


def _heights(file: GlbFile, face: Face, textures: Mapping[str, int]) -> dict[str, Any]:
    """Add relief and folds, and how much of each fold shows at each streamed vertex, and its drive."""
    if face.maps is None:
        return {}
    slope = face.maps.relief / (face.maps.texel * FULL)
    found: dict[str, Any] = {
        name: {"texture": textures[name], "slope": slope} for name in ("relief", "folds") if name in textures
    }
    if "folds" in found:
        folds = Folds(face)
        weights = file.add(np.rint(folds.weights * 255).astype(np.uint8).ravel(), normalised=True)
        found["folds"] |= {"weights": weights, "drives": folds.to_json()}
    return found
