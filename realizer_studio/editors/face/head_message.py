"""The message with a head for the page: mesh, feature points, zones, and tables."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.errors import FaceError
from realizer.face.au.units import units
from realizer.face.features import NAMES, Point, read_features
from realizer.face.load import MESH, load_folder, read_head
from realizer.face.mesh_geometry import nearest_vertex
from realizer.face.reading import read_arrays
from realizer.tables import action_units, csv_rows, faps
from realizer_studio.faces.mpeg4 import rigid
from realizer_studio.faces.mpeg4.defaults import default_setup
from realizer_studio.faces.mpeg4.fap_limits import usual_range
from realizer_studio.faces.mpeg4.parameters import FILE, read_setup, setup_table
from realizer_studio.faces.mpeg4.point_finder import PUPILS, TEETH, template
from realizer_studio.faces.mpeg4.zone_build import bind_to_skin, setup_of
from realizer_studio.faces.mpeg4.zone_fields import DIRECTIONS, pairs
from realizer_studio.faces.mpeg4.zones import Setup, mirrorable

FACE_NAME = re.compile(r"[^a-z0-9_-]+")  # characters that are not allowed in a face's name


@dataclass(frozen=True)
class _PointName:
    name: str
    says: str


def head_message(folder: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the description of the head in a folder, and its arrays.

    Raises:
        FaceError: the folder is no sound face.
    """
    face = load_folder(folder, "mpeg4")
    at, parts = face.vertices.astype(np.float64), dict(face.parts)
    points = {name: point.place for name, point in read_features(folder / "features.csv").items()}
    setup = mirrorable(default_setup(at, face.triangles, points, parts["skin"]), at[slice(*parts["skin"])])
    table, by = setup_table(setup), []
    if (folder / FILE).is_file():
        # The zones of the face, and default zones, not applied yet, for its other FAPs.
        by = sorted(read_setup(folder / FILE).zones)
        own_table = setup_table(setup_of(folder))
        zones = {zone["fap"]: zone for zone in (*table["zone"], *own_table["zone"])}
        table |= {**own_table, "zone": list(zones.values()), "masks": table["masks"] | own_table["masks"]}
    head = {
        "type": "head",
        "name": face.name,
        "parts": parts,
        "points": points,
        "setup": {**table, "points": points},
        "by": by,
        "keep": set(by) < set(setup.zones),  # whether FAPs without zones have other fields
        "fapu": {unit: face.fapu.metres(unit) for unit in ("MNS", "MW", "ENS", "ES", "IRISD")},
        **_tables(),
    }
    vertex, nearest, weight = bind_to_skin(at, parts)
    arrays = {
        "vertices": face.vertices, "triangles": face.triangles.astype(np.uint32),
        "grown": vertex.astype(np.uint32), "near": nearest.astype(np.uint32) + parts["skin"][0],
        "share": weight,
    }  # fmt: skip
    head["eyes"] = [
        {
            "centre": centre.tolist(), "size": size,
            "ball": float(bulge[2]), "angles": bulge[0].tolist(), "heights": bulge[1].tolist(),
        }
        for (_, size), (_, centre), bulge in zip(
            rigid.balls(at, parts), face.basis["eyes"], face.basis["bulges"], strict=True
        )
    ]  # fmt: skip
    return head, arrays


@cache
def _tables() -> dict[str, Any]:
    """Return the tables of FAPs, neighbours and feature points."""
    rows = [
        {
            "fap": row.fap, "name": row.name, "unit": row.unit, "point": row.feature_point,
            "mirror": row.mirror, "sign": row.sign, "least": row.least, "most": row.most,
            "way": DIRECTIONS.get(row.direction),
            "usual": [-usual_range(row.fap, -1) if row.least < 0 else 0, usual_range(row.fap, 1)],
        }
        for row in faps()[2:]
    ]  # fmt: skip
    template_points = {name: position.round(4).tolist() for name, position in template()[0].items()}
    descriptions = {row.name: row.says for row in csv_rows("point_names.csv", _PointName, __package__)}
    links = [[pair.one, pair.other] for pair in pairs()]
    names = {row.au: row.name for row in action_units()}
    displaced = [[unit.au, names[unit.au]] for unit in units().values() if unit.kind == "displacement"]
    return {
        "faps": rows,
        "pairs": links,
        "template": template_points,
        "says": descriptions,
        "units": displaced,
    }


def moved_points(folder: Path, positions: Mapping[str, Any]) -> dict[str, Point]:
    """Return the feature points at new positions, each with the nearest vertex of its part."""
    parts = read_head(folder)["parts"]
    at = np.asarray(read_arrays(folder / "mesh.npz", MESH)["vertices"], np.float64)
    out = read_features(folder / "features.csv")
    for name, position in positions.items():
        if name not in NAMES:
            raise FaceError(f"points: wanted feature points such as 2.1, got {name[:40]!r}")
        if np.abs(np.array(position) - out[name].place).max() < 1e-7:
            continue
        part = PUPILS.get(name) or TEETH.get(name, ("skin",))[0]
        part = "tongue" if name.startswith("6.") else part
        first, last = parts.get(part, parts["skin"])
        out[name] = Point(name, nearest_vertex(at, position, (first, last)), *position)
    return out


def is_same_head(setup: Setup, points: Mapping[str, Any]) -> bool:
    """Return whether the points of a file are those of the head, so that its zones need no conversion."""
    shared = set(setup.points) & set(points)
    return bool(shared) and all(np.allclose(setup.points[k], points[k], atol=2e-6) for k in shared)
