"""Compares the FAPs of action units in the table with a face's own action unit shapes.

python benchmarks/au_to_fap.py [--face NAME] [--data FOLDER] [--worst 5]

Each action unit has full intensity on both sides. `cosine` compares its shape with the result of its FAPs and
the MPEG-4 deformer, over the visible skin of the left half; `ratio` is the ratio of their lengths. `cap` is
the best cosine that any values of the 66 FAPs could reach, `far` the longest displacement of the shape. The
last column says where they differ. With the unpacked CC0 data the shapes are measured again, with a few more.
"""

from __future__ import annotations

import argparse
import os
from dataclasses import dataclass, replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
import numpy.typing as npt

from realizer.animation.axis import au, axis
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames
from realizer.core.array_types import Float32, Float64, Int32
from realizer.face.au.units import units
from realizer.face.deform import deform
from realizer.face.load import folder_of, load_face
from realizer.face.model import Face
from realizer.tables import faps
from realizer_studio.faces.au.measure import UnitMeasurement, read_shapes
from realizer_studio.faces.au.shapes import measure_shapes

# Part of the face -> its feature points.
PARTS = {
    "brows": ("4.1", "4.3", "4.5", "11.1", "11.3"),
    "upper lids": ("3.1", "3.13"),
    "lower lids": ("3.3", "3.9", "3.7", "3.11"),
    "cheeks": ("5.1", "5.3"),
    "nose": ("9.1", "9.3", "9.5", "9.7", "9.12", "9.13"),
    "upper lip": ("2.2", "2.6", "8.1", "8.5", "8.9"),
    "lower lip": ("2.3", "2.8", "8.2", "8.7"),
    "corners": ("2.4", "8.3"),
    "chin": ("2.1", "2.10", "2.11"),
    "jaw": ("2.13",),
}
DIRECTIONS = ("across", "up", "forward")
TARGET = 0.75
ON_SKIN = 0.95  # least part of the landmarks on the skin; otherwise the shapes belong to another mesh
# Action units that are not among Wojdel's, and the face units that show them.
EXTRA_UNITS = {14: "mouthDimple:1", 29: "jawForward:1", 33: "cheekPuff:1", 34: "cheekPuff:1"}


@dataclass(frozen=True, eq=False)
class Skin:
    """The visible skin of a face's left half, and how FAPs move it.

    Attributes:
        marks: (n,) indices into the shapes' landmarks; vertices: (n,) into the face's vertices.
        part: (n,) name of the part of the face each belongs to.
    """

    face: Face
    marks: Int32
    vertices: Int32
    part: npt.NDArray[np.str_]

    @classmethod
    def of(cls, face: Face, shape: UnitMeasurement) -> Skin:
        from scipy.spatial import cKDTree

        first, last = face.parts["skin"]
        skin = face.vertices[first:last]
        off, nearest = (np.asarray(found) for found in cKDTree(skin).query(shape.at))
        marks = np.flatnonzero(shape.visible & (off < 1e-5))
        nearest = nearest[marks]
        if len(marks) < ON_SKIN * shape.visible.sum():
            raise SystemExit(
                f"{face.name}: {1 - len(marks) / shape.visible.sum():.0%} of its shapes lie off its skin; "
                "measure them by --data"
            )
        names = [(part, name) for part, points in PARTS.items() for name in points]
        near = np.asarray(cKDTree([face.points[name] for _, name in names]).query(skin[nearest])[1])
        part = np.array([names[k][0] for k in near])
        return cls(face, marks.astype(np.int32), (first + nearest).astype(np.int32), part)

    def moves(self, rows: Float32) -> Float64:
        """Return the displacements by FAP rows (n, 68), (n, len(vertices), 3) metres."""
        moved = deform(self.face, rows)[:, self.vertices]
        return np.asarray(moved - self.face.vertices[self.vertices], np.float64)

    def fields(self) -> Float64:
        """Return the displacements by a tenth of each FAP's range, (68, len(vertices), 3) metres."""
        rows = np.zeros((68, 68), np.float32)
        for row in faps():
            rows[row.fap - 1, row.fap - 1] = row.most / 10
        return self.moves(rows)


def table_faps(numbers: list[int]) -> Float32:
    """Return (n, 68), the FAPs of each action unit at full intensity on both sides, by the table."""
    values = np.zeros((len(numbers), len(axis())), np.float32)
    for row, number in zip(values, numbers, strict=True):
        row[[target.column for target in au(number)]] = 1
    return to_fap(AUFrames(np.arange(len(values), dtype=np.float64), values)).values


def cosine(a: Float64, b: Float64) -> float:
    """Return the cosine between two displacement fields; 0 if one of them is zero."""
    lengths = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float((a * b).sum()) / lengths if lengths else 0.0


def mirrored_fields(fields: Float64) -> Float64:
    """Return (k, n), the field of each pair of mirrored FAPs with the same value."""
    fields_by_pair = []
    for row in faps()[2:]:
        if row.mirror >= row.fap:
            both = fields[row.fap - 1].ravel().copy()
            if row.mirror != row.fap:
                both += row.sign * fields[row.mirror - 1].ravel()
            if (row.mirror != row.fap or row.sign > 0) and both.any():
                fields_by_pair.append(both)
    return np.array(fields_by_pair)


def where(skin: Skin, wanted: Float64, got: Float64) -> str:
    """Return the parts of the face that have most of the difference after scaling, and its main direction."""
    length = float((got * got).sum())
    left = wanted - got * (float((wanted * got).sum()) / length if length else 0.0)
    squares = left**2
    whole = squares.sum()
    shares = {part: float(squares[skin.part == part].sum() / whole) for part in PARTS}
    most = [part for part in sorted(shares, key=lambda k: -shares[k]) if shares[part] >= 0.18][:3]
    ways = squares.sum(axis=0) / whole
    parts = ", ".join(f"{part} {shares[part]:.0%}" for part in most) or "everywhere"
    return f"{parts}; {DIRECTIONS[int(ways.argmax())]} {ways.max():.0%}"


def shapes_of(face: Face, data: Path | None) -> dict[int, UnitMeasurement]:
    """Return a face's shapes from its folder, or measured in the data."""
    folder = folder_of(face.name)
    if data is None:
        return read_shapes(folder / "au_shapes.npz")
    more = [replace(units()[1], au=number, shapes=shapes) for number, shapes in EXTRA_UNITS.items()]
    found = measure_shapes(face, folder, data) | measure_shapes(face, folder, data, more)
    return dict(sorted(found.items()))


def main() -> None:
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--face", default="default")
    options.add_argument("--data", type=Path)
    options.add_argument("--worst", type=int, default=5)
    chosen = options.parse_args()
    face = load_face(chosen.face)
    shapes = shapes_of(face, chosen.data)
    skin = Skin.of(face, next(iter(shapes.values())))
    base = np.linalg.qr(mirrored_fields(skin.fields()).T)[0]
    made = skin.moves(table_faps(list(shapes)))
    print(
        f"{face.name}: {len(shapes)} action units with a shape, {len(skin.vertices)} vertices of visible skin"
    )
    print(f"{'AU':>4}{'cosine':>8}{'ratio':>7}{'cap':>6}{'far mm':>8}  difference")
    found = {}
    for number, got in zip(shapes, made, strict=True):
        wanted = shapes[number].moves[skin.marks]
        flat = wanted.ravel()
        cap = float(np.linalg.norm(base.T @ flat) / np.linalg.norm(flat))
        found[number] = cosine(wanted, got)
        ratio = np.linalg.norm(got) / np.linalg.norm(wanted)
        far = 1000 * np.linalg.norm(wanted, axis=1).max()
        print(f"{number:>4}{found[number]:8.3f}{ratio:7.2f}{cap:6.2f}{far:8.1f}  {where(skin, wanted, got)}")
    worst = sorted(found, key=lambda k: found[k])[: chosen.worst]
    print(
        f"mean {np.mean(list(found.values())):.3f} (aim {TARGET}); worst "
        + ", ".join(f"AU{number} {found[number]:.3f}" for number in worst)
    )


if __name__ == "__main__":
    main()
