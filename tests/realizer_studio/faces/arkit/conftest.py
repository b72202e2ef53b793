"""GLB files to import: a shipped face with ARKit's shapes made of its own FAPs, and odder ones."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from realizer.core.colours import linear
from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.face.model import Face
from realizer.tables import au_to_fap
from realizer.tables.arkit_names import shapes

FLOAT, USHORT, UINT = 5126, 5123, 5125
LIPS = {*range(4, 14), 16, 17, *range(51, 61)}


class Glb:
    """A GLB file that is being written."""

    def __init__(self) -> None:
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "tests"},
            "scene": 0, "scenes": [{"nodes": []}],
            "nodes": [], "meshes": [], "materials": [], "accessors": [], "bufferViews": [], "buffers": [],
        }  # fmt: skip
        self.data = b""

    def view(self, array: np.ndarray) -> int:
        raw = np.ascontiguousarray(array).tobytes()
        self.json["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(raw)})
        self.data += raw + b"\0" * (-len(raw) % 4)
        return len(self.json["bufferViews"]) - 1

    def accessor(self, array: np.ndarray, component: int = FLOAT, **more: Any) -> int:
        array = np.asarray(array)
        width = 1 if array.ndim == 1 else array.shape[1]
        kind = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4", 16: "MAT4"}[width]
        dtype = {5120: "<i1", 5121: "<u1", 5122: "<i2", USHORT: "<u2", UINT: "<u4", FLOAT: "<f4"}[component]
        self.json["accessors"].append(
            {"bufferView": self.view(array.astype(dtype)), "componentType": component,
             "count": len(array), "type": kind, **more}
        )  # fmt: skip
        return len(self.json["accessors"]) - 1

    def sparse(self, array: np.ndarray) -> int:
        rows = np.flatnonzero(np.abs(array).max(axis=1) > 0)
        rows = rows if len(rows) else np.array([0])
        self.json["accessors"].append(
            {"componentType": FLOAT, "count": len(array), "type": "VEC3", "sparse": {
                "count": len(rows),
                "indices": {"bufferView": self.view(rows.astype("<u4")), "componentType": UINT},
                "values": {"bufferView": self.view(array[rows].astype("<f4"))}}}
        )  # fmt: skip
        return len(self.json["accessors"]) - 1

    def mesh(
        self, name: str, vertices: np.ndarray, triangles: np.ndarray, colours: np.ndarray | None,
        moves: dict[str, np.ndarray], material: str | None = None, sparse: bool = False, **node: Any,
    ) -> None:  # fmt: skip
        attributes = {"POSITION": self.accessor(vertices)}
        if colours is not None:
            attributes["COLOR_0"] = self.accessor(linear(colours.astype(np.uint8)))
        primitive: dict[str, Any] = {
            "attributes": attributes, "indices": self.accessor(triangles.ravel(), UINT),
        }  # fmt: skip
        put = self.sparse if sparse else self.accessor
        if moves:
            primitive["targets"] = [{"POSITION": put(move)} for move in moves.values()]
        if material is not None:
            self.json["materials"].append(
                {"name": material, "pbrMetallicRoughness": {"roughnessFactor": 0.7}}
            )
            primitive["material"] = len(self.json["materials"]) - 1
        mesh: dict[str, Any] = {"name": name, "primitives": [primitive]}
        if moves:
            mesh["extras"] = {"targetNames": list(moves)}
        self.json["meshes"].append(mesh)
        self.json["nodes"].append({"name": name, "mesh": len(self.json["meshes"]) - 1, **node})
        self.json["scenes"][0]["nodes"].append(len(self.json["nodes"]) - 1)

    def bytes(self) -> bytes:
        self.json["buffers"] = [{"byteLength": len(self.data)}]
        text = json.dumps(self.json).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
        chunks += struct.pack("<II", len(self.data), 0x004E4942) + self.data
        return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def fap_row(name: str) -> np.ndarray:
    """(68,) FAPs that an ARKit shape stands for, by the tables."""
    shape, row = shapes()[name], np.zeros(68, np.float32)
    if name in ("jawLeft", "jawRight"):
        row[14] = 150 if name == "jawRight" else -150
        return row
    if name == "mouthClose":
        row[2] = fap_row("jawOpen")[2]
        return row - fap_row("jawOpen")
    for piece in au_to_fap():
        if piece.au == shape.au and (not shape.side or piece.side in ("", shape.side)):
            row[piece.fap - 1] = piece.fap_to * shape.intensity
    if name.startswith("eyeLook"):  # the table turns both eyes
        row[[23, 25, 19, 21] if shape.side == "L" else [22, 24, 18, 20]] = 0
    if name.startswith("mouthRoll") or name == "mouthShrugUpper":
        upper = [3, 7, 8, 16, 50, 54, 55]
        lower = [fap - 1 for fap in LIPS if fap - 1 not in upper]
        row[upper if name == "mouthRollLower" else [*lower, 17]] = 0
    return row


def arkit_shapes(face: Face) -> dict[str, np.ndarray]:
    """ARKit's name -> (n, 3) what the face's own FAPs make of it."""
    names = [name for name in shapes() if fap_row(name).any()]
    made = deform(face, np.stack([fap_row(name) for name in names])).astype(float) - face.vertices
    return dict(zip(names, made, strict=True))


def face_glb(
    face: Face, scale: float = 1.0, turn: np.ndarray | None = None, spell: Callable[[str], str] = str,
    only: tuple[str, ...] | None = None, **how: Any,
) -> bytes:  # fmt: skip
    """The face as GLB with ARKit's shapes, a mesh a part, in another unit and direction."""
    glb, turn = Glb(), np.eye(3) if turn is None else turn
    made = {name: move for name, move in arkit_shapes(face).items() if only is None or name in only}
    for part, (first, last) in face.parts.items():
        mine = slice(first, last)
        triangles = face.triangles[(face.triangles >= first).all(1) & (face.triangles < last).all(1)] - first
        moves = {spell(name): move[mine] @ turn.T * scale for name, move in made.items()}
        moves = {name: move for name, move in moves.items() if np.abs(move).max() > 1e-6 * scale}
        glb.mesh(
            part, face.vertices[mine] @ turn.T * scale, triangles, face.colours[mine], moves, part, **how
        )
    return glb.bytes()


@pytest.fixture(scope="session")
def ada_glb(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("glb") / "ada.glb"
    path.write_bytes(face_glb(load_face("ada")))
    return path


@pytest.fixture
def new_glb() -> type[Glb]:
    """A GLB to put meshes into."""
    return Glb


@pytest.fixture
def write_head(tmp_path: Path) -> Callable[..., Path]:
    """Writes ada as GLB, in the unit, the direction and the spelling asked for."""

    def write(**how: Any) -> Path:
        path = tmp_path / "head.glb"
        path.write_bytes(face_glb(load_face("ada"), **how))
        return path

    return write
