"""A face as a binary glTF 2.0 file: rest mesh, normals, colours, parts."""

from dataclasses import asdict
from typing import Any

import numpy as np

from realizer.core.colours import linear
from realizer.face.glb_file import ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER, GlbFile
from realizer.face.model import Face
from realizer.face.surface import face_scale, normals


def to_glb(face: Face) -> bytes:
    """Return the face's rest mesh as GLB.

    One primitive with POSITION, NORMAL, COLOR_0 (linear, as glTF asks), _OCCLUSION and _GLOSS. The mesh's
    `extras` hold what a client needs for streamed vertices: scale and offset, parts (name -> first and last
    + 1 vertex, first and last + 1 triangle), FAPU in metres, source and licence.
    """
    # glTF wants unit normals; a vertex without a triangle gets one that points forward.
    ups = normals(face, face.vertices[None])[0]
    ups[np.abs(ups).sum(axis=1) == 0] = (0, 0, 1)
    colours = np.full((len(face.colours), 4), 65535, np.uint16)
    colours[:, :3] = np.rint(linear(face.colours) * 65535)
    file = GlbFile()
    attributes = {
        "POSITION": file.add(face.vertices.astype("<f4"), target=ARRAY_BUFFER, bounds=True),
        "NORMAL": file.add(ups.astype("<f4"), target=ARRAY_BUFFER),
        "COLOR_0": file.add(colours, target=ARRAY_BUFFER, normalised=True),
        "_OCCLUSION": file.add(face.occlusion.astype("<f4"), target=ARRAY_BUFFER),
        "_GLOSS": file.add(face.gloss.astype("<f4"), target=ARRAY_BUFFER),
    }
    indices = file.add(face.triangles.astype("<u4").ravel(), target=ELEMENT_ARRAY_BUFFER)
    scale, offset = face_scale(face)
    rights, look = f"{face.licence}; {face.source}", {"metallicFactor": 0.0, "roughnessFactor": 0.6}
    document = {
        "asset": {"version": "2.0", "generator": "bml-realizer", "copyright": rights},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": face.name, "mesh": 0}],
        "materials": [{"name": "face", "doubleSided": True, "pbrMetallicRoughness": look}],
        "meshes": [
            {
                "name": face.name,
                "primitives": [{"attributes": attributes, "indices": indices, "material": 0, "mode": 4}],
                "extras": {
                    "scale": scale,
                    "offset": [float(x) for x in offset],
                    "parts": _parts(face),
                    "fapu": asdict(face.fapu),
                    "source": face.source,
                    "licence": face.licence,
                },
            }
        ],
    }
    return file.bytes_of(document)


def _parts(face: Face) -> dict[str, Any]:
    """Return name -> its range of vertices and of triangles (a part's triangles are adjacent)."""
    lowest = face.triangles.min(axis=1)
    out = {}
    for name, (first, last) in face.parts.items():
        mine = np.flatnonzero((lowest >= first) & (lowest < last))
        triangles = [int(mine[0]), int(mine[-1]) + 1] if len(mine) else [0, 0]
        out[name] = {"vertices": [first, last], "triangles": triangles}
    return out
