"""Heads without shapes, as files: the neutral meshes of shipped faces."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import numpy as np
import trimesh

from realizer.face.load import load_face
from realizer.face.mesh_geometry import part_triangles

CENTIMETRES = 100.0


def bare_head(
    path: Path, face: str = "ada", *, without: Collection[str] = (), names: bool = True, finer: int = 0
) -> Path:
    """Write the mesh of a face in centimetres as GLB, OBJ or PLY, a mesh for each part.

    Args:
        without: parts that are left out; names: call the meshes after their parts.
        finer: how often the triangles of the skin are split in four.
    """
    head = load_face(face)
    scene = trimesh.Scene()
    for number, (part, ends) in enumerate(head.parts.items()):
        if part in ("tears", *without):
            continue
        at = head.vertices[slice(*ends)].astype(np.float64)
        triangles = part_triangles(head.triangles, ends)
        for _ in range(finer if part == "skin" else 0):
            at, triangles = trimesh.remesh.subdivide(at, triangles)
        name = part if names else f"mesh{number}"
        mesh = trimesh.Trimesh(at * CENTIMETRES, triangles, process=False)
        scene.add_geometry(mesh, geom_name=name, node_name=name)
    if path.suffix == ".ply":
        scene.to_mesh().export(path)
    else:
        scene.export(path)
    return path
