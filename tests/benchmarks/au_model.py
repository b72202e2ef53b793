"""How near Wojdel's face model comes to a face's action unit shapes (her table 4.3), and what it costs.

python tests/benchmarks/au_model.py [--face NAME] [--pictures FILE.png]
"""

from __future__ import annotations

import argparse
import os
import statistics
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as in the drawing process

import numpy as np

from realizer.face import deform, load_face, normals
from realizer.face.au import Deformer, read_model, read_shapes, table, table_text
from realizer.face.load import folder_of
from realizer.tables import au_to_fap

SHOWN = (1, 4, 6, 9, 10, 12, 15, 18, 27, 43)
HERS = 0.120


def fap_row(aus: dict[int, float]) -> np.ndarray:
    """(68,) FAPs of action units on both sides, by the table's end points."""
    row = np.zeros(68, np.float32)
    for piece in au_to_fap():
        if piece.au in aus:
            row[piece.fap - 1] += aus[piece.au] * piece.fap_to
    return row


def pictures(deformer: Deformer, path: Path) -> None:
    """Ten action units by FAPs (above) and by this model (below)."""
    from PIL import Image

    from realizer.render.cameras import camera_for
    from realizer.render.light import preset
    from realizer.render.offscreen import Canvas

    face = deformer.face
    bands = []
    for view in ("front", "three-quarter"):
        camera = camera_for(face, view)
        canvas = Canvas(face, (300, 300), camera, preset())
        for vertices in (
            deform(face, np.stack([fap_row({au: 1.0}) for au in SHOWN])),
            deformer(np.stack([deformer.row({au: 1.0}) for au in SHOWN])),
        ):
            ups = normals(face, vertices)
            bands.append(np.hstack([canvas.draw(v, u) for v, u in zip(vertices, ups, strict=True)]))
        canvas.close()
    Image.fromarray(np.vstack(bands)).save(path)
    print(f"{path}: AUs {SHOWN}; FAPs above, model below; front, three-quarter")


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--face", default="default")
    options.add_argument("--pictures", type=Path)
    chosen = options.parse_args()
    face, folder = load_face(chosen.face), folder_of(chosen.face)
    measured = read_shapes(folder / "au_shapes.npz")
    for form in ("published", "extended"):
        model = read_model(folder / f"au_{form}.toml")
        print(f"{face.name}, {form} form (she reports a mean of {HERS:.3f})")
        print(table_text(table(model, measured)), end="\n\n")
    deformer = Deformer(face, model)
    rows = np.random.default_rng(0).uniform(0, 0.3, (64, len(deformer.columns))).astype(np.float32)
    deformer(rows)
    spent = []
    for _ in range(5):
        began = time.perf_counter()
        deformer(rows)
        spent.append(time.perf_counter() - began)
    print(
        f"{len(face.vertices)} vertices, {1000 * statistics.median(spent) / len(rows):.2f} ms a frame of 64"
    )
    if chosen.pictures:
        pictures(deformer, chosen.pictures)


if __name__ == "__main__":
    main()
