"""Fits the FAPs of action units to a face's own shapes, and prints them as rows of the table.

python training/fit_au_to_fap.py [--face NAME] [--data FOLDER] [--au 12 ...] [--write]

For each action unit with a shape, the FAP values minimise the squared error of the MPEG-4 deformer over the
visible skin of the left half. They lie within the bounds of `au_to_fap_bounds.csv`, which come from published
maps and from FACS. Lips do not pass through each other; AU26 opens them at least as far as AU25, and AU27 as
far as AU26. Values are rounded, and invisible ones are left out.
"""

from __future__ import annotations

import argparse
import os
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, minimize

from benchmarks.au_to_fap import Skin, cosine, shapes_of, table_faps
from realizer import tables
from realizer.core.array_types import Float32, Float64
from realizer.face.load import load_face
from realizer.tables import by_number, faps, read_csv

# FAPs of the upper and the lower lip; the gap between them is -(upper + lower).
INNER = ((4, 5), (8, 10))
LIPS = (*INNER, (51, 52), (55, 57))
OPENS_AS_FAR = {26: 25, 27: 26}  # action unit -> another one that opens the lips no further
STEP = 5.0  # values are rounded to multiples of it
# Of several solutions for the same shape, ridge regression finds the one with the smallest values.
RIDGE = 0.02  # of the mean square of a FAP's displacements
MIN_SHARE = 0.04  # of the action unit's displacement; FAPs that contribute less are left out


@dataclass(frozen=True, slots=True)
class Row:
    """A row of au_to_fap_bounds.csv; FAPs of the left side stand for both sides."""

    au: int
    length: float
    fap: int
    least: float
    most: float


def pair(values: Float64, numbers: list[int]) -> Float32:
    """Return (68,), a FAP row with the values of `numbers` and of their mirrors."""
    row = np.zeros(68, np.float32)
    for number, value in zip(numbers, values, strict=True):
        fap = faps()[number - 1]
        row[[fap.fap - 1, fap.mirror - 1]] = value, fap.sign * value
    return row


def fit(
    skin: Skin, wanted: Float64, bounds: list[Row], gaps: dict[tuple[int, int], float]
) -> dict[int, float]:
    """Return FAP -> value at full intensity, within the bounds; the gaps of the lips are at least `gaps`."""
    numbers = [bound.fap for bound in bounds]
    low, high = np.array([b.least for b in bounds]), np.array([b.most for b in bounds])
    values = np.clip(0.0, low, high).astype(np.float64)
    size = np.array([faps()[number - 1].most / 20 for number in numbers])
    apart = np.array([[-1.0 if n in lips else 0.0 for n in numbers] for lips in gaps]) * size
    for _ in range(3):  # jaw and lids are not linear: linearise again at the last fit
        rows = [pair(values, numbers), *(pair(values + size * one, numbers) for one in np.eye(len(size)))]
        moves = skin.moves(np.stack(rows)).reshape(len(rows), -1)
        fields = moves[1:] - moves[0]  # displacements by a step of `size`
        target = wanted.ravel() - moves[0] + (values / size) @ fields
        limits = LinearConstraint(apart, np.array(list(gaps.values())), np.inf)
        values = np.clip(solve(fields, target, Bounds(low / size, high / size), limits) * size, low, high)
    length = np.linalg.norm(wanted)
    strong = np.abs(values / size) * np.sqrt(np.diag(fields @ fields.T)) > MIN_SHARE * length
    rounded = np.clip(np.where(strong, values, 0.0), low, high)
    return {n: float(v) for n, v in zip(numbers, np.rint(rounded / STEP) * STEP, strict=True) if v}


def solve(fields: Float64, target: Float64, bounds: Bounds, limits: LinearConstraint) -> Float64:
    """Return (k,), the factors of the fields (k, n) whose sum is nearest to the target (n,)."""
    whole = float(target @ target)
    square, aimed = fields @ fields.T / whole, fields @ target / whole
    square += RIDGE * np.diag(np.diag(square))

    def slope(x: Float64) -> Float64:
        return np.asarray(square @ x - aimed)

    found = minimize(
        lambda x: float(x @ square @ x / 2 - aimed @ x),
        np.clip(np.zeros(len(fields)), bounds.lb, bounds.ub),
        jac=slope,
        bounds=bounds,
        constraints=limits,
        method="SLSQP",
        options={"maxiter": 300, "ftol": 1e-12},
    )
    return np.asarray(found.x, np.float64)


def least_gaps(number: int, found: dict[int, dict[int, float]]) -> dict[tuple[int, int], float]:
    """Return the least gap of each pair of points on the lips."""
    if number not in OPENS_AS_FAR:
        return dict.fromkeys(INNER, 0.0)
    before = found.get(OPENS_AS_FAR[number]) or dict(
        enumerate(table_faps([OPENS_AS_FAR[number]])[0].tolist(), 1)
    )
    return {(a, b): -before.get(a, 0.0) - before.get(b, 0.0) for a, b in LIPS}


def rows_of(number: int, values: dict[int, float]) -> list[str]:
    """Return the rows of the table for both sides."""
    sides = ("L", "R") if by_number()[number].sides else ("",)
    lines = []
    for side in sides:
        asks = dict(values) if side == "L" else {}
        if side != "L":
            asks = {faps()[n - 1].mirror: faps()[n - 1].sign * v for n, v in values.items()}
        if not side:
            asks |= values
        lines += [f"{number},{side},{fap},0,1,0,{value:.0f}" for fap, value in sorted(asks.items())]
    return lines


def write(new: dict[int, list[str]]) -> None:
    """Replace the rows of action units in the table."""
    path = Path(tables.__file__).with_name("au_to_fap.csv")
    lines = []
    for line in path.read_text("utf-8").splitlines():
        number = line.partition(",")[0]
        if number.isdecimal() and int(number) in new:
            lines += new[int(number)]
            new[int(number)] = []
        else:
            lines.append(line)
    path.write_text("\n".join(lines) + "\n", "utf-8")


def main() -> None:
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--face", default="default")
    options.add_argument("--data", type=Path, help="unpacked CC0 data to measure the shapes in")
    options.add_argument("--au", type=int, nargs="*")
    options.add_argument("--write", action="store_true", help="put the rows into the table")
    chosen = options.parse_args()
    face = load_face(chosen.face)
    shapes = shapes_of(face, chosen.data)
    skin = Skin.of(face, next(iter(shapes.values())))
    path = Path(__file__).with_name("au_to_fap_bounds.csv")
    bounds: dict[int, list[Row]] = defaultdict(list)
    for bound in read_csv(path.read_text("utf-8"), Row, path.name):
        bounds[bound.au].append(bound)
    found: dict[int, dict[int, float]] = {}
    for number in bounds:
        if chosen.au and number not in chosen.au:
            continue
        wanted = shapes[number].moves[skin.marks]
        part = bounds[number][0].length
        found[number] = fit(skin, part * wanted, bounds[number], least_gaps(number, found))
        row = pair(np.array(list(found[number].values())), list(found[number]))
        before, after = skin.moves(np.stack([table_faps([number])[0], row]))
        near = f"{cosine(wanted, before):.3f} -> {cosine(wanted, after):.3f}"
        ratio = np.linalg.norm(after) / np.linalg.norm(wanted)
        print(f"# AU{number}: cosine {near}, ratio {ratio:.2f}")
        print("\n".join(rows_of(number, found[number])), flush=True)
    if chosen.write:
        write({number: rows_of(number, values) for number, values in found.items()})


if __name__ == "__main__":
    main()
