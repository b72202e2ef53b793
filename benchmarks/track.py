"""Measures how well films of our faces are tracked: python benchmarks/track.py [--face NAME]

To measure a face that the networks never saw, train them without it, and add `--weights without_ben.npz`:
python training/train_action_units.py --data DIR --without ben -o without_ben.npz
"""

from __future__ import annotations

import argparse
import importlib.util
import tempfile
import time
from pathlib import Path

import numpy as np

import realizer
from realizer.animation.axis import AU_NAMES
from realizer_studio.tracking import regressor
from realizer_studio.tracking.files import unit_columns
from realizer_studio.tracking.follower import follow
from realizer_studio.tracking.person_recording import Recording, record
from realizer_studio.tracking.pictures import read_pictures
from realizer_studio.tracking.regressor import MEASURED_UNITS

# Action units that are shown one after the other, and together as emotions do.
SHOWN = (
    (1,), (2,), (4,), (5,), (6,), (7,), (9,), (10,), (12,), (15,), (17,), (18,), (20,), (25,), (26,), (43,),
    (6, 12), (4, 5, 7, 23), (1, 2, 5, 26), (1, 4, 15), (9, 10, 17), (1, 2, 4, 5, 20, 25), (6, 12, 25), (4, 7),
    (1, 2),
)  # fmt: skip
REPORTED = (1, 2, 4, 5, 6, 7, 9, 10, 12, 15, 17, 18, 20, 25, 26, 43)
EACH = 1.4  # s
PHOTOGRAPH = {"strongest": ("6", "12"), "least": ("4", "9")}


def document() -> str:
    """Return BML with all of `SHOWN`."""
    facs = "\n".join(
        f'<faceFacs id="f{k}_{unit}" au="{unit}" amount="{0.6 + 0.4 * (k % 2)}" start="{k * EACH + 0.2:.2f}" '
        f'attackPeak="{k * EACH + 0.5:.2f}" relax="{k * EACH + 0.9:.2f}" end="{k * EACH + 1.2:.2f}"/>'
        for k, units in enumerate(SHOWN)
        for unit in units
    )
    turns = "\n".join(
        f'<head id="h{k}" lexeme="{"NOD" if k % 2 else "SHAKE"}" start="{3 + 6 * k}" end="{4.5 + 6 * k}"/>'
        for k in range(5)
    )
    return f'<bml xmlns="http://www.bml-initiative.org/bml/bml-1.0" id="film">{facs}{turns}</bml>'


def correlations(found: np.ndarray, true: np.ndarray, least: float) -> np.ndarray:
    """Return r of each column (n, k), NaN for those that do not move."""
    return np.array([
        np.corrcoef(f, t)[0, 1] if t.std() > least and f.std() > 0 else (0.0 if t.std() > least else np.nan)
        for f, t in zip(found.T, true.T, strict=True)
    ])  # fmt: skip


def film(face: str, folder: Path, size: int) -> None:
    """Track a film of a face, and print how well."""
    shown = realizer.realize(document(), face=face, fps=25)
    path = shown.save(folder / f"{face}.mp4", camera="front", size=(size, size))
    begin = time.perf_counter()
    _, pictures = read_pictures(path)
    times, people = follow(pictures)
    recording = record(people[0], times, 25.0)
    spent = time.perf_counter() - begin
    count = min(len(recording.times), len(shown.faps.times))
    print(f"{face}: {count} frames, {1000 * spent / count:.1f} ms each, seen {recording.seen.mean():.1%}")
    units(recording, shown.aus.aus[:count].copy())
    true = shown.faps.values[:count].astype(np.float64)
    found = recording.faps[:count]
    moving = [
        k
        for k in range(2, 68)
        if k not in (47, 48, 49) and true[:, k].std() > 8 and abs(true[:, k]).max() > 40
    ]
    by_fap = correlations(found, true, 0.0)
    print(f"  FAPs with movement: median r {np.nanmedian(by_fap[moving]):.2f} of {len(moving)} (0.85 asked)")
    print("  " + " ".join(f"{k + 1}:{by_fap[k]:.2f}" for k in moving))
    turned = np.degrees((found[:, 47:50] - true[:, 47:50]) * 1e-5)
    wrong, bias = np.median(np.linalg.norm(turned, axis=1)), np.median(turned, axis=0).round(1)
    print(f"  head: median error {wrong:.2f} degrees (3 asked), of which bias {bias}")


def units(recording: Recording, true: np.ndarray) -> None:
    """Print the correlation of each action unit."""
    columns = [AU_NAMES().index(name) for name in MEASURED_UNITS]
    # The lids close in the same way in a blink.
    for side in "LR":
        shut, blink = (AU_NAMES().index(f"{number}{side}") for number in (43, 45))
        true[:, shut] = np.maximum(true[:, shut], true[:, blink])
    r = correlations(recording.units[: len(true)], true[:, columns].astype(np.float64), 0.005)
    means = {}
    for number in REPORTED:
        sides = [
            value for name, value in zip(MEASURED_UNITS, r, strict=True) if name.rstrip("LR") == str(number)
        ]
        means[number] = float(np.nanmean(sides))
    print(f"  action units: mean r {np.nanmean(list(means.values())):.2f} over {len(means)} (0.75 asked)")
    print("  " + " ".join(f"AU{number}:{value:.2f}" for number, value in means.items()))


def photograph() -> None:
    """Print the action units of scikit-image's photograph of an astronaut, who smiles."""
    found = importlib.util.find_spec("skimage")
    if found is None or not found.submodule_search_locations:
        print("the photograph needs scikit-image")
        return
    _, pictures = read_pictures(Path(found.submodule_search_locations[0]) / "data" / "astronaut.png")
    times, people = follow(pictures)
    columns = unit_columns(record(people[0], times, 25.0))
    ranked = sorted(
        ((float(v[0]), name) for name, v in columns.items() if name in MEASURED_UNITS), reverse=True
    )
    print(
        "astronaut (AU6 and AU12 strongest, AU4 and AU9 under 0.2 asked): "
        + " ".join(f"{n} {v:.2f}" for v, n in ranked[:12])
    )
    print(
        "  "
        + " ".join(
            f"{name} {columns[name][0]:.2f}" for name in ("6L", "6R", "12L", "12R", "4L", "4R", "9L", "9R")
        )
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--face", nargs="*", default=["ben"])
    parser.add_argument("--weights", type=Path, default=regressor.WEIGHTS)
    parser.add_argument("--size", type=int, default=384)
    parser.add_argument("--folder", type=Path, help="where films are kept")
    options = parser.parse_args()
    regressor.WEIGHTS = options.weights
    with tempfile.TemporaryDirectory() as temporary:
        for face in options.face:
            film(face, options.folder or Path(temporary), options.size)
    photograph()


if __name__ == "__main__":
    main()
