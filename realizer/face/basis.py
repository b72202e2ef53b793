"""The displacement matrices of a face, read from fields.npz."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.array_types import Float32, Int32
from realizer.core.errors import FaceError
from realizer.face.coupling import contours_of
from realizer.face.model import Fapu
from realizer.face.reading import read_arrays
from realizer.tables import faps

FAPS = 68
# Rows after the FAPs': they are multiplied by 1 - cos and sin of an angle, the last by metres.
JAW_COS, JAW_SIN, TONGUE_COS, TONGUE_SIN, JAW_DROP = range(FAPS, FAPS + 5)
# BEYOND + FAP is the number of the row that is added for what the FAP exceeds its limit here, in FAPU, the
# most that action units, visemes and emotions ask for: more skin around goes along then.
BEYOND = FAPS + 5
LIMITS = {
    **{6: 185, 7: 185, 53: 185, 54: 185, 15: 150}, **{37: 130, 38: 130, 39: 80, 40: 80, 41: 305, 42: 305},
    **{61: 80, 62: 80, 63: 110, 18: 195},
}  # fmt: skip
ROWS = BEYOND + FAPS

FARTHEST = 1e4  # m
AGAIN = "build or import the face again"
MOST_BULGE = 0.002  # m
LOOKS = {23, 24, 25, 26}  # FAPs that turn eyeballs, or have fields where the eyes are no balls

ARRAYS = {
    "row": 1,  # which FAP (its number) or extra row (69..73 are JAW_COS.. + 1, then BEYOND + FAP), ascending
    "start": 1,  # where the row's part of vertex and move begins; one more than rows
    "vertex": 1,
    "move": 2,  # metres for each metre (radian) of FAP at the feature point
    "head": 1,  # 0..255: how far each vertex turns with the head
    "jaw_pivot": 1,
    "head_pivot": 1,
    "eye_centre": 2,  # left, right
    "lid": 1,  # vertices that must not sink into the eyeballs
    "lid_eye": 1,  # 0 left, 1 right
    "lid_radius": 1,  # metres
}


def basis_from(
    path: Path,
    vertices: Float32,
    points: Mapping[str, Float32],
    parts: Mapping[str, tuple[int, int]],
    fapu: Fapu,
) -> dict[str, Any]:
    """Read the displacement basis.

    Returns:
        moving: (first, last + 1), the vertices that any FAP but the head's moves.
        fields: (3 x moving, 141) sparse float32, metres per FAPU, with the jaw's and the tongue's five.
        head: (n, 1) float32 0..1; head_pivot: (3,).
        chin: (2,) float64, y and z of 2.1 about the jaw's axis.
        eyes: ((first, last + 1), (3,) centre) for left and right, (0, 0) of an eye that has fields instead
            of a ball; thrust: metres per FAPU of 27 and 28.
        contours: which FAPs of the lips hold together.
        bulges: of both eyes: angles from the optical axis, and how far the eye comes out of its ball there,
            in radians and metres, (j,) each; and the ball's radius.
        lid, lid_eye, lid_radius: (k,) each; the radius is the least distance to an eye without bulges.

    Raises:
        FaceError: a missing array, an index out of range, or a value that is not finite.
    """
    from scipy.sparse import csr_matrix

    stored = read_arrays(path, ARRAYS)
    if faults := array_faults(stored, len(vertices)):
        raise FaceError(f"{path}: {faults[0]}")
    first, last = int(stored["vertex"].min()), int(stored["vertex"].max()) + 1
    fields = np.zeros((ROWS, last - first, 3), np.float32)
    table = faps()
    for k, row in enumerate(stored["row"].tolist()):
        part = slice(int(stored["start"][k]), int(stored["start"][k + 1]))
        # The rows of jaw and tongue are in metres already.
        scale = 1.0 if FAPS < row <= BEYOND else fapu.metres(table[(row - 1) % BEYOND].unit)
        fields[row - 1, stored["vertex"][part] - first] = stored["move"][part].astype(np.float32) * scale
    balls = not LOOKS & set(stored["row"].tolist())
    chin = np.asarray(points["2.1"][1:], np.float64) - stored["jaw_pivot"][1:]
    centres = stored["eye_centre"].astype(np.float32)
    bulges = [
        _bulge(vertices[slice(*parts[name])] - centre if balls else centre[None][:0])
        for name, centre in zip(("left_eye", "right_eye"), centres, strict=True)
    ]
    lid, side = stored["lid"].astype(np.int32), stored["lid_eye"].astype(np.int32)
    radius = stored["lid_radius"].astype(np.float32)
    for k, bulge in enumerate(bulges):
        mine = side == k
        radius[mine] -= bulge_at(bulge, vertices[lid[mine]] - centres[k], np.array([0.0, 0.0, 1.0]))
    return {
        "moving": (first, last),
        "fields": csr_matrix(fields.reshape(ROWS, -1).T),
        "head": (stored["head"].astype(np.float32) / 255)[:, None],
        "head_pivot": stored["head_pivot"].astype(np.float32),
        "chin": chin,
        "eyes": tuple(
            (parts[name] if balls else (0, 0), centre)
            for name, centre in zip(("left_eye", "right_eye"), centres, strict=True)
        ),
        "bulges": tuple(bulges),
        "thrust": np.float32(fapu.metres("ES")),
        "open_jaw": np.float64(fapu.metres("MNS")),
        "contours": contours_of(points, fapu),
        "lid": lid,
        "lid_eye": side,
        "lid_radius": radius,
    }


def _bulge(eye: Float32) -> tuple[Float32, Float32, float]:
    """Return the bulge of an eye's cornea, for its vertices (n, 3) from its centre, n may be 0."""
    if not len(eye):
        return np.zeros(1, np.float32), np.zeros(1, np.float32), 1.0
    away = np.linalg.norm(eye, axis=1)
    radius = float(np.percentile(away, 25))
    angle = np.arccos(np.clip(eye[:, 2] / np.maximum(away, 1e-9), -1, 1))
    order = np.argsort(angle, kind="stable")
    return angle[order], np.clip(away - radius, 0, MOST_BULGE)[order], radius


def bulge_at(bulge: tuple[Float32, Float32, float], away: Any, axis: Any) -> Float32:
    """Return how far an eye comes out of its ball before places (..., 3) from its centre.

    Args:
        bulge: as in the basis.
        axis: unit vector of the optical axis, that can be multiplied with the places.
    """
    angles, heights, radius = bulge
    x, y = away[..., 0], away[..., 1]
    front = np.sqrt(np.maximum(radius**2 - x * x - y * y, 0))
    cosine = (x * axis[..., 0] + y * axis[..., 1] + front * axis[..., 2]) / radius
    return np.asarray(np.interp(np.arccos(np.clip(cosine, -1, 1)), angles, heights), np.float32)


def array_faults(stored: Mapping[str, Any], n: int) -> list[str]:
    """Return the faults of a fields.npz that was made for another mesh than one of n vertices, or damaged."""
    faults = []
    for name, size, each in (("head", n, "vertex"), ("jaw_pivot", 3, "axis"), ("head_pivot", 3, "axis")):
        if len(stored[name]) != size:
            faults.append(f"{name}: wanted {size} values, one a {each}, got {len(stored[name])}; {AGAIN}")
    row, count = stored["row"], len(stored["vertex"])
    for name, low, high in (
        *(("vertex", 0, n - 1), ("lid", 0, n - 1), ("lid_eye", 0, 1), ("row", 1, ROWS)),
        *(("start", 0, count), ("head", 0, 255)),
    ):
        array = stored[name]
        if array.dtype.kind not in "biu":
            faults.append(f"{name}: wanted whole numbers, got {array.dtype}; {AGAIN}")
        elif len(array) and (array.min() < low or array.max() > high):
            faults.append(f"{name}: wanted {low}..{high}, got {array.min()}..{array.max()}; {AGAIN}")
    for name, wanted in (
        ("start", (len(row) + 1,)),
        ("move", (count, 3)),
        ("eye_centre", (2, 3)),
        ("lid_eye", stored["lid"].shape),
        ("lid_radius", stored["lid"].shape),
    ):
        if stored[name].shape != wanted:
            faults.append(f"{name}: wanted an array {wanted}, got {stored[name].shape}; {AGAIN}")
    if not count:
        faults.append(f"vertex: wanted vertices that move, got none; {AGAIN}")
    for name in ("move", "lid_radius", "jaw_pivot", "head_pivot", "eye_centre"):
        if not (np.abs(stored[name]) <= FARTHEST).all():
            faults.append(
                f"{name}: wanted finite numbers, got NaN, infinity or more than {FARTHEST:g}; {AGAIN}"
            )
    return faults


def pack(rows: Mapping[int, Any], threshold: float = 2e-3) -> dict[str, Any]:
    """Return the stored form of fields: row number -> (n, 3) becomes row, start, vertex, move.

    Movements below the threshold (relative to the feature point's) are left out, because they are invisible.
    """
    numbers, starts, vertices, moves = [], [0], [], []
    for number in sorted(rows):
        field = np.asarray(rows[number], np.float64)
        # Turns are in metres from the pivot.
        least = threshold * 0.05 if FAPS < number <= JAW_DROP else threshold
        index: Int32 = np.flatnonzero(np.abs(field).max(axis=1) > least).astype(np.int32)
        numbers.append(number)
        vertices.append(index)
        moves.append(field[index].astype(np.float16))
        starts.append(starts[-1] + len(index))
    return {
        "row": np.array(numbers, np.int32),
        "start": np.array(starts, np.int32),
        "vertex": np.concatenate(vertices).astype(np.int32),
        "move": np.concatenate(moves),
    }


def unpack(stored: Mapping[str, Any], n_vertices: int) -> dict[int, Any]:
    """Return what `pack` stored: row number -> (n_vertices, 3)."""
    rows = {}
    for k, number in enumerate(stored["row"].tolist()):
        part = slice(int(stored["start"][k]), int(stored["start"][k + 1]))
        rows[number] = np.zeros((n_vertices, 3))
        rows[number][stored["vertex"][part]] = stored["move"][part]
    return rows
