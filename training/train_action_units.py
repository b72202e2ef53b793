"""Trains the networks that measure action units: python training/train_action_units.py [--data DIR]

Our own heads, and random ones that `realizer faces build NAME --random SEED` makes (REALIZER_FACES says
where they are), are drawn in random expressions, poses and lights. The networks learn what the pictures show
from what `realizer_studio.tracking.landmarks` sees in them. `--without NAME...` leaves faces out, and
measures them.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image
from scipy.spatial.transform import Rotation

from realizer.animation.axis import AU_NAMES
from realizer.face.load import list_faces
from realizer_studio.tracking.landmarks import landmarks
from realizer_studio.tracking.regressor import (
    MEASURED_FAPS,
    MEASURED_UNITS,
    PARTS,
    UP,
    WEIGHTS,
    Components,
    inputs,
    upright,
)
from training.painted_faces import sitting

PICTURES = 24  # of a sitting
KEPT = {"shape": 48, "traits": 64, "eyes": 24}  # components
HIDDEN = (96, 64)
BATCH, STEPS, STEP = 128, 12000, 2e-3
DROPPED = 0.15  # of the hidden units in training
NOISE = 0.05  # of the components
FAP_WEIGHT, TURN_WEIGHT = 0.15, 4.0  # of their errors, beside those of action units
MOST_GAIN = 1.5
# Of these the mean correlation is reported.
REPORTED = ("1", "2", "4", "5", "6", "7", "9", "10", "12", "15", "17", "18", "20", "25", "26", "43")

Data = Mapping[str, Any]


def prepare(folder: Path, seed: int, sittings: int) -> None:
    """Write what the landmarks see of drawn faces, with the truth."""
    random, begin = np.random.default_rng(seed), time.perf_counter()
    names, kept = [info.name for info in list_faces()], []
    for k in range(sittings):
        name = names[random.integers(len(names))]
        for one in sitting(name, random, PICTURES):
            face = landmarks(Image.fromarray(one.picture), one.region, refine=True)
            seen = face.points, face.traits, face.eyes
            kept.append((name, 10000 * seed + k, *seen, one.aus, one.faps, one.neutral))
        if k % 10 == 9 or k == sittings - 1:
            print(f"{time.perf_counter() - begin:5.0f} s: {k + 1} of {sittings} sittings", flush=True)
            columns = ("names", "sittings", "points", "traits", "eyes", "aus", "faps", "neutral")
            data = {c: np.array(v) for c, v in zip(columns, zip(*kept, strict=True), strict=True)}
            np.savez(folder / f"faces{seed}.npz", **data)


def read(folder: Path) -> dict[str, Any]:
    """Return the data of all seeds, with the true rotations."""
    files = [np.load(path) for path in sorted(folder.glob("faces*.npz"))]
    data = {name: np.concatenate([file[name] for file in files]) for name in files[0].files}
    pitch, yaw, roll = (data["faps"][:, 47:50].astype(float) * 1e-5).T
    (a, b, c), (d, e, f) = np.cos([pitch, yaw, roll]), np.sin([pitch, yaw, roll])
    rows = [
        b * c + d * e * f,
        c * d * e - b * f,
        a * e,
        a * f,
        a * c,
        -d,
        b * d * f - c * e,
        e * f + b * c * d,
        a * b,
    ]
    return data | {"rotations": np.stack(rows, axis=1).reshape(-1, 3, 3)}


def mean_head(data: Data) -> np.ndarray:
    """Return the landmarks (468, 3) of the mean head, from neutral faces that turn."""
    chosen = data["neutral"]
    turns, flat = data["rotations"][chosen, :2], (data["points"][chosen] * UP)[:, :, :2]
    flat = flat - flat.mean(axis=1, keepdims=True)
    head = np.einsum("nki,npk->pi", turns, flat)
    for _ in range(20):
        seen = np.einsum("nki,pi->npk", turns, head)
        scale = (seen * flat).sum(axis=(1, 2)) / (seen**2).sum(axis=(1, 2))
        scaled = turns * scale[:, None, None]
        left = np.einsum("nki,nkj->ij", scaled, scaled)
        head = np.linalg.solve(left, np.einsum("nki,npk->pi", scaled, flat).T).T
    twin = np.array([np.linalg.norm(head * (-1, 1, 1) - point, axis=1).argmin() for point in head])
    head = (head + head[twin] * (-1, 1, 1)) / 2
    return head / np.linalg.norm(head[33] - head[263])


def bases(data: Data, chosen: np.ndarray) -> dict[str, np.ndarray]:
    """Return the mean head, and mean and principal components of each part of what is seen."""
    head = mean_head({name: values[chosen] for name, values in data.items()})
    arrays = {"head": head.astype(np.float16)}
    _, shapes = upright(data["points"], arrays["head"])
    for part, values in zip(PARTS, (shapes, data["traits"], data["eyes"]), strict=True):
        flat = values.reshape(len(values), -1)[chosen].astype(np.float32)
        moved = flat - rests(flat, data["sittings"][chosen], data["neutral"][chosen])
        size, turns = np.linalg.eigh(moved.T @ moved / len(moved))
        size, turns = np.sqrt(np.abs(size[::-1])), turns[:, ::-1]
        count = KEPT[part]
        basis = turns[:, :count] / np.sqrt(size[:count] * size[0])
        scale = np.abs(basis).max() / 127
        arrays[f"{part}_mean"] = flat.mean(axis=0).astype(np.float16)
        arrays[f"{part}_basis"] = np.rint(basis / scale).astype(np.int8)
        arrays[f"{part}_basis_scale"] = np.float32(scale)
    return arrays


def rests(values: np.ndarray, sittings: np.ndarray, neutral: np.ndarray) -> np.ndarray:
    """Return for each row the mean of the neutral rows of its sitting."""
    rest = np.zeros_like(values)
    for number in np.unique(sittings):
        here = sittings == number
        rest[here] = values[here & neutral].mean(axis=0)
    return rest


def seen_by(data: Data, arrays: Mapping[str, np.ndarray]) -> Components:
    """Return the components of all faces."""
    values = []
    rotations, shapes = upright(data["points"], arrays["head"])
    for part, seen in zip(PARTS, (shapes, data["traits"], data["eyes"]), strict=True):
        basis = arrays[f"{part}_basis"].astype(np.float32) * arrays[f"{part}_basis_scale"]
        flat = seen.reshape(len(seen), -1).astype(np.float32)
        values.append((flat - arrays[f"{part}_mean"].astype(np.float32)) @ basis)
    return Components(np.concatenate(values, axis=1).astype(np.float64), rotations)


def train(x: np.ndarray, y: np.ndarray, steps: int, seed: int) -> list[list[np.ndarray]]:
    """Return the layers of a perceptron by which x gives y; Adam minimises the square of the error."""
    random = np.random.default_rng(seed)
    sizes = (x.shape[1], *HIDDEN, y.shape[1])
    layers = [
        [random.normal(0, np.sqrt(2 / a), (a, b)).astype(np.float32), np.zeros(b, np.float32)]
        for a, b in pairwise(sizes)
    ]
    layers[-1][0] *= 0.1
    layers[-1][1] += y.mean(axis=0)
    moments = [[np.zeros_like(v) for v in 2 * layer] for layer in layers]
    for step in range(1, steps + 1):
        rows = random.integers(len(x), size=BATCH)
        outs = [x[rows] + np.float32(NOISE) * random.standard_normal((BATCH, x.shape[1]), np.float32)]
        for i, (w, b) in enumerate(layers):
            out = outs[-1] @ w + b
            if i < len(HIDDEN):
                keep = random.random(out.shape, np.float32) >= DROPPED
                out = np.maximum(out, 0) * keep * np.float32(1 / (1 - DROPPED))
            outs.append(out)
        error = (outs[-1] - y[rows]) * np.float32(2 / BATCH)
        speed = STEP * min(1, step / 500) * 0.5 * (1 + np.cos(np.pi * step / steps))
        for i in reversed(range(len(layers))):
            w = layers[i][0]
            slopes = (outs[i].T @ error + np.float32(1e-4) * w, error.sum(axis=0))
            if i:
                error = (error @ w.T) * (outs[i] > 0) * np.float32(1 / (1 - DROPPED))
            for j, slope in enumerate(slopes):
                m, v = moments[i][j], moments[i][j + 2]
                m += np.float32(0.1) * (slope - m)
                v += np.float32(0.001) * (slope * slope - v)
                rise = np.float32(speed * np.sqrt(1 - 0.999**step) / (1 - 0.9**step))
                layers[i][j] -= rise * m / (np.sqrt(v) + np.float32(1e-8))
    return layers


def applied(layers: list[list[np.ndarray]], x: np.ndarray) -> np.ndarray:
    """Return the outputs of a perceptron."""
    for i, (w, b) in enumerate(layers):
        x = x @ w + b if i == len(HIDDEN) else np.maximum(x @ w + b, 0)
    return x


def trained(data: Data, without: list[str], steps: int, seed: int) -> dict[str, np.ndarray]:
    """Return the arrays of `regressor.stored`, trained on all faces but some."""
    chosen = ~np.isin(data["names"], without)
    arrays = bases(data, chosen)
    seen = seen_by(data, arrays)
    columns = [AU_NAMES().index(name) for name in MEASURED_UNITS]
    moved = data["faps"][:, np.array(MEASURED_FAPS) - 1]
    spread = np.maximum(moved[chosen].std(axis=0), 1.0)  # some never move
    turned = Rotation.from_matrix(np.einsum("nji,njk->nik", seen.rotations, data["rotations"])).as_rotvec()
    wanted = np.concatenate(
        [data["aus"][:, columns], FAP_WEIGHT * moved / spread, TURN_WEIGHT * turned], axis=1
    ).astype(np.float32)
    # Undone in the last layer.
    units = np.concatenate([np.ones(len(columns)), spread / FAP_WEIGHT, np.full(3, 1 / TURN_WEIGHT)])
    neutral = rests(seen.values, data["sittings"], data["neutral"])
    for name, rest in (("against", neutral), ("alone", None)):
        x = inputs(seen, rest)
        layers = train(x[chosen], wanted[chosen], steps, seed)
        result, still = applied(layers, x), chosen & data["neutral"]
        if without:
            report(name, result[~chosen], wanted[~chosen], data["neutral"][~chosen])
        # A network that is not certain says too little: neutral faces become 0, others move as far as ours.
        moving = chosen & ~data["neutral"]
        gain = np.clip(wanted[moving].std(axis=0) / (result[moving].std(axis=0) + 1e-6), 1, MOST_GAIN)
        gain[-3:] = 1
        zero = np.append(result[still].mean(axis=0)[:-3], np.zeros(3))
        w, b = layers[-1]
        layers[-1] = [w * gain * units, (b - zero) * gain * units]
        for i, layer in enumerate(layers):  # the last one has FAPs of rotations, which are large
            kind = np.float32 if i == len(HIDDEN) else np.float16
            arrays |= {f"{name}_{'wb'[j]}{i}": part.astype(kind) for j, part in enumerate(layer)}
    return arrays


def report(name: str, result: np.ndarray, wanted: np.ndarray, neutral: np.ndarray) -> None:
    """Print how well faces are measured that were not learned from."""
    chosen, found = ~neutral, {}
    for k, unit in enumerate(MEASURED_UNITS):
        if wanted[chosen, k].std() > 0.01:
            r = np.corrcoef(result[chosen, k], wanted[chosen, k])[0, 1]
            found.setdefault(unit.rstrip("LR"), []).append(r)
    means = {unit: float(np.mean(both)) for unit, both in found.items()}
    first = len(MEASURED_UNITS)
    faps = [
        np.corrcoef(result[chosen, k], wanted[chosen, k])[0, 1]
        for k in range(first, wanted.shape[1] - 3)
        if wanted[chosen, k].std() > 0.01
    ]
    wrong = np.degrees(np.linalg.norm(result[:, -3:] - wanted[:, -3:], axis=1) / TURN_WEIGHT)
    mean = np.mean([means[unit] for unit in REPORTED if unit in means])
    print(f"{name}: mean r of units {mean:.3f}, median of FAPs {np.median(faps):.3f}, ", end="")
    print(f"head {np.median(wrong):.2f} degrees; ", end="")
    print(" ".join(f"{unit} {value:.2f}" for unit, value in means.items()), flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, default=Path("/tmp"), help="where faces*.npz are kept")
    parser.add_argument(
        "--prepare",
        type=int,
        nargs="*",
        default=[],
        metavar="SEED",
        help="draw faces first, a set for each seed",
    )
    parser.add_argument("--sittings", type=int, default=400)
    parser.add_argument("--steps", type=int, default=STEPS)
    parser.add_argument("--seed", type=int, default=3, help="of the networks")
    parser.add_argument("--without", nargs="*", default=[], help="faces to leave out")
    parser.add_argument("-o", "--output", type=Path, default=WEIGHTS)
    options = parser.parse_args()
    for seed in options.prepare:
        prepare(options.data, seed, options.sittings)
    arrays = trained(read(options.data), options.without, options.steps, options.seed)
    np.savez_compressed(options.output, **arrays)
    print(f"{options.output}: {options.output.stat().st_size} bytes")


if __name__ == "__main__":
    main()
