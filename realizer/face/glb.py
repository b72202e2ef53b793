"""A face in, a binary glTF 2.0 file out: rest mesh, normals, colours, parts."""

from __future__ import annotations

import json
import struct
from dataclasses import asdict
from typing import Any

import numpy as np

from realizer.colours import linear
from realizer.face.model import Face
from realizer.face.surface import face_scale, normals

__all__ = ["to_glb"]

FLOAT, USHORT, UINT = 5126, 5123, 5125  # glTF component types
ARRAY_BUFFER, ELEMENT_ARRAY_BUFFER = 34962, 34963


def to_glb(face: Face) -> bytes:
    """The face's rest mesh as GLB.

    One primitive with POSITION, NORMAL, COLOR_0 (linear, as glTF asks), _OCCLUSION and _GLOSS. The mesh's
    `extras` hold what a client of streamed vertices needs: scale and offset, parts (name -> first and last
    + 1 vertex, first and last + 1 triangle), FAPU in metres, source and licence.
    """
    # glTF wants unit normals; a vertex without a triangle gets one that points forward.
    ups = normals(face, face.vertices[None])[0]
    ups[np.abs(ups).sum(axis=1) == 0] = (0, 0, 1)
    colours = np.full((len(face.colours), 4), 65535, np.uint16)
    colours[:, :3] = np.rint(linear(face.colours) * 65535)
    arrays: dict[str, tuple[Any, int, str, bool]] = {
        "POSITION": (face.vertices.astype("<f4"), FLOAT, "VEC3", False),
        "NORMAL": (ups.astype("<f4"), FLOAT, "VEC3", False),
        "COLOR_0": (colours.astype("<u2"), USHORT, "VEC4", True),
        "_OCCLUSION": (face.occlusion.astype("<f4"), FLOAT, "SCALAR", False),
        "_GLOSS": (face.gloss.astype("<f4"), FLOAT, "SCALAR", False),
        "indices": (face.triangles.astype("<u4").ravel(), UINT, "SCALAR", False),
    }
    views, accessors, data = [], [], b""
    for name, (array, component, kind, normalised) in arrays.items():
        raw = array.tobytes()
        target = ELEMENT_ARRAY_BUFFER if name == "indices" else ARRAY_BUFFER
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": len(raw), "target": target})
        accessor: dict[str, Any] = {
            "bufferView": len(views) - 1,
            "componentType": component,
            "count": len(array),
            "type": kind,
        }
        if normalised:
            accessor["normalized"] = True
        if name == "POSITION":
            accessor["min"] = [float(x) for x in array.min(axis=0)]
            accessor["max"] = [float(x) for x in array.max(axis=0)]
        accessors.append(accessor)
        data += raw + b"\0" * (-len(raw) % 4)
    attributes = {name: k for k, name in enumerate(arrays) if name != "indices"}
    scale, offset = face_scale(face)
    document = {
        "asset": {
            "version": "2.0",
            "generator": "bml-realizer",
            "copyright": f"{face.licence}; {face.source}",
        },
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"name": face.name, "mesh": 0}],
        "materials": [
            {
                "name": "face",
                "doubleSided": True,
                "pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.6},
            }
        ],
        "meshes": [
            {
                "name": face.name,
                "primitives": [
                    {"attributes": attributes, "indices": len(arrays) - 1, "material": 0, "mode": 4}
                ],
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
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = (
        struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    )
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def _parts(face: Face) -> dict[str, Any]:
    """name -> vertex range and the triangle range that uses it (a part's triangles stand together)."""
    lowest = face.triangles.min(axis=1)
    out = {}
    for name, (first, last) in face.parts.items():
        mine = np.flatnonzero((lowest >= first) & (lowest < last))
        triangles = [int(mine[0]), int(mine[-1]) + 1] if len(mine) else [0, 0]
        out[name] = {"vertices": [first, last], "triangles": triangles}
    return out
