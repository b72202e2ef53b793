"""Measures the errors of Wojdel's face model (her table 4.3), also on coarser meshes, and its time.

python benchmarks/au_model.py [--face NAME] [--pictures FILE.png] [--meshes FILE.png]
"""

from __future__ import annotations

import argparse
import dataclasses
import os
import statistics
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as in the drawing process

import numpy as np
from decimate import decimated

from realizer.animation.axis import au, axis
from realizer.animation.frames import AUFrames
from realizer.animation.pose import poses
from realizer.face.au.file import read_model
from realizer.face.au.model import Model
from realizer.face.deform import deform
from realizer.face.load import folder_of, load_face
from realizer.face.mesh_geometry import corner_shares, nearest_points
from realizer.face.model import Face
from realizer.face.surface import normals
from realizer_studio.faces.au.measure import UnitMeasurement, read_shapes
from realizer_studio.faces.au.unit_fit import table, table_text
from tests.au_mixers import mix

SHOWN = (1, 4, 6, 9, 10, 12, 15, 18, 27, 43)
PUBLISHED_ERROR = 0.120
SIZES = (280, 454, 1762)  # vertices of her figure 4.3
HAPPY = {6: 0.8, 12: 0.9, 25: 0.7}
THINGS = {"left_eye": "left eye", "right_eye": "right eye", "lower_teeth": "jaw", "tongue": "jaw"}


def frames(shown: list[Mapping[int, float]]) -> AUFrames:
    """Return frames of action units, the same on both sides."""
    values = np.zeros((len(shown), len(axis())), np.float32)
    for row, aus in zip(values, shown, strict=True):
        for number, amount in aus.items():
            row[[target.column for target in au(number)]] = amount
    return AUFrames(np.arange(len(values), dtype=np.float64), values)


def pictures(face: Face, views: tuple[str, ...], shapes: Callable[[], list[Any]]) -> np.ndarray:
    """Return pictures of (n, n_vertices, 3) shapes, one row for each view."""
    from realizer.render.cameras import camera_for
    from realizer.render.light import preset
    from realizer.render.worker import open_canvas

    bands = []
    for view in views:
        _, canvas = open_canvas(face, (300, 300), camera_for(face, view), preset())
        for vertices in shapes():
            ups = normals(face, vertices)
            bands.append(np.hstack([canvas.draw(v, u) for v, u in zip(vertices, ups, strict=True)]))
        canvas.close()
    return np.vstack(bands)


def front(face: Face) -> tuple[np.ndarray, np.ndarray]:
    """Return the skin's vertices, (n, 3) metres, and the triangles of its front, without neck and hair."""
    first, last = face.parts["skin"]
    at = face.vertices[first:last].astype(np.float64)
    triangles = face.triangles[((face.triangles >= first) & (face.triangles < last)).all(axis=1)] - first
    return at, triangles[((at[:, 2] > -0.05) & (at[:, 1] > -0.12))[triangles].all(axis=1)].astype(np.intp)


def meshes(
    face: Face, model: Model, measured: Mapping[int, UnitMeasurement]
) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return coarser meshes (her figure 4.3), and print the errors of the model on each.

    The error at the vertices is the distance to the measured displacement. The error between them is the
    distance between the displacement that a triangle's corners interpolate and that of the model.
    """
    at, triangles = front(face)
    fine = np.unique(triangles)
    made = []
    print(f"vertices triangles at vertices between   mean e/d_max of {len(measured)} units")
    for size in SIZES:
        index, corners = decimated(at, triangles, size)
        coarse = at[index]
        off, hit, share = nearest(coarse[corners], at[fine])
        here, between = [], []
        for one in measured.values():
            moves = model.displacement(one.au, coarse)
            far = np.linalg.norm(one.moves[one.visible], axis=1).max()
            places = {tuple(place): k for k, place in enumerate(one.at.tolist())}
            pairs = [(k, places[tuple(p)]) for k, p in enumerate(coarse.tolist()) if tuple(p) in places]
            mine, theirs = np.array(pairs).T
            counts = one.visible[theirs] & (np.linalg.norm(one.moves[theirs], axis=1) > 0.01 * far)
            miss = moves[mine[counts]] - one.moves[theirs[counts]]
            here.append(np.linalg.norm(miss, axis=1).mean() / far)
            goes = model.displacement(one.au, at[fine])
            counts = (np.linalg.norm(goes, axis=1) > 0.01 * far) & (off < 0.003)
            miss = (share[:, :, None] * moves[corners[hit]]).sum(axis=1) - goes
            between.append(np.linalg.norm(miss[counts], axis=1).mean() / far)
        print(f"{len(index):8} {len(corners):9} {np.mean(here):12.4f} {np.mean(between):8.4f}")
        made.append((index, corners))
    return made


def nearest(triangles: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the distance of points to the nearest of (m, 3, 3) triangles, its index, and weights."""
    from scipy.spatial import cKDTree

    candidates = cKDTree(triangles.mean(axis=1)).query(at, 24)[1]
    places = nearest_points(triangles[candidates], at)
    off = np.linalg.norm(places - at[:, None], axis=2)
    best = off.argmin(axis=1)
    row = np.arange(len(at))
    hit = candidates[row, best]
    return off[row, best], hit, corner_shares(triangles[hit], places[row, best])


def masked(face: Face, index: np.ndarray, corners: np.ndarray) -> tuple[Face, dict[str, tuple[int, int]]]:
    """Return a face whose skin consists of these vertices, and its parts."""
    first, _ = face.parts["skin"]
    order, parts, triangles = [index + first], {"skin": (0, len(index))}, [corners]
    for part in ("left_eye", "right_eye", "upper_teeth", "lower_teeth", "tongue", "brows"):
        low, high = face.parts[part]
        begin = sum(map(len, order))
        mine = face.triangles[((face.triangles >= low) & (face.triangles < high)).all(axis=1)]
        triangles.append(mine - low + begin)
        order.append(np.arange(low, high))
        parts[part] = (begin, begin + high - low)
    kept = np.concatenate(order)
    arrays = {name: getattr(face, name)[kept] for name in ("vertices", "colours", "occlusion", "gloss")}
    arrays["triangles"] = np.concatenate(triangles).astype(np.int32)
    # Wrinkles are left out, because they refer to the fine skin.
    return dataclasses.replace(face, parts=parts, feature_points={}, **arrays), parts


def happy(face: Face, model: Model, parts: Mapping[str, tuple[int, int]]) -> np.ndarray:
    """Return (1, n_vertices, 3), a smile by the mixers of her model, part by part."""
    out = face.vertices.copy()
    for part, (low, high) in parts.items():
        thing: Any = THINGS.get(part, "fixed" if part == "upper_teeth" else "face")
        out[low:high] = mix(model, face.vertices[low:high].astype(np.float64), HAPPY, thing)
    return out[None]


def cost(face: Face, other: Face) -> None:
    """Print the time of a frame with this deformer and with FAPs."""
    rng = np.random.default_rng(0)
    shown = [
        {n: float(a) for n, a in zip(SHOWN, rng.uniform(0, 1, len(SHOWN)), strict=True)} for _ in range(250)
    ]
    spent = {}
    for kind, one in (("mpeg4", other), ("au", face)):
        rows = poses(frames(shown), one.inputs)
        for name, count, times in (("a frame of 250", 250, 7), ("a frame alone", 1, 60)):
            deform(one, rows[:count])
            elapsed = []
            for _ in range(times):
                begin = time.perf_counter()
                deform(one, rows[:count])
                elapsed.append((time.perf_counter() - begin) / count)
            spent[kind, name] = 1000 * statistics.median(elapsed)
    for name in ("a frame of 250", "a frame alone"):
        ours, theirs = spent["au", name], spent["mpeg4", name]
        print(
            f"{name}, {len(face.vertices)} vertices: {ours:.3f} ms, "
            f"{ours / theirs:.2f} times the FAPs' {theirs:.3f}"
        )


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--face", default="default")
    options.add_argument("--pictures", type=Path, help="Ten units by FAPs (above) and by this model (below).")
    options.add_argument("--meshes", type=Path, help="A smile on three coarser meshes and on the face's own.")
    chosen = options.parse_args()
    from PIL import Image

    face, other = (load_face(chosen.face, deformer=kind) for kind in ("au", "mpeg4"))
    folder = folder_of(chosen.face)
    measured = read_shapes(folder / "au_shapes.npz")
    for form in ("published", "extended"):
        model = read_model(folder / f"au_{form}.toml")
        print(f"{face.name}, {form} form (she reports a mean of {PUBLISHED_ERROR:.3f})")
        print(table_text(table(model, measured)), end="\n\n")
    coarser = meshes(face, model, measured)
    print()
    cost(face, other)
    if chosen.pictures:
        clip = frames([{number: 1.0} for number in SHOWN])
        views = ("front", "three-quarter")
        both = [deform(one, poses(clip, one.inputs)) for one in (other, face)]
        Image.fromarray(pictures(face, views, lambda: both)).save(chosen.pictures)
        print(f"{chosen.pictures}: AUs {SHOWN}; FAPs above, model below; {', '.join(views)}")
    if chosen.meshes:
        columns = []
        at, triangles = front(face)
        own = (np.arange(len(at)), triangles)
        for mesh in (*coarser, own):
            small, parts = masked(face, *mesh)
            rows = (small.vertices[None], happy(small, model, parts))
            columns.append(pictures(small, ("front", "three-quarter"), lambda rows=rows: list(rows)))
        Image.fromarray(np.hstack(columns)).save(chosen.meshes)
        print(
            f"{chosen.meshes}: neutral and smile, front and three-quarter, {', '.join(map(str, SIZES))}, all"
        )


if __name__ == "__main__":
    main()
