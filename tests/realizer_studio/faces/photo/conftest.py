"""A mesh numbered as the base mesh, whose landmarks lie as on a mean head, with targets that change it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer.tables import toml_table
from realizer_studio.faces.person.makehuman import OBJ
from realizer_studio.faces.person.sliders import DEFAULTS, person_tables
from realizer_studio.faces.photo.shape import LandmarkAnchors
from realizer_studio.tracking.regressor import stored

COUNT = 20_000
WIDTH = 0.9  # decimetres between the outer corners of the eyes
EYE = (0.0, 0.03, 0.0)  # between the eyes, beside the middle of all landmarks


def base() -> np.ndarray:
    """Return the vertices (n, 3) in decimetres; those that no landmark needs are between the eyes."""
    head = np.asarray(stored()["head"], float)
    at, count = np.zeros((COUNT, 3)), np.zeros(COUNT)
    for view in ("front", "side"):
        anchors = LandmarkAnchors.of(view)
        for corner in anchors.corners.T:
            np.add.at(at, corner, WIDTH * (head[anchors.numbers] - head[[33, 263]].mean(axis=0)))
            np.add.at(count, corner, 1)
    return at / np.maximum(count, 1)[:, None]


@pytest.fixture(scope="session")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder of data: the mesh, and each target as a smooth change of its own, alike left and right."""
    folder, at = tmp_path_factory.mktemp("data"), base()
    (folder / OBJ).parent.mkdir(parents=True)
    lines = [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in at]
    eyes = [f"g helper-{side}-eye\nf {k}/1 {k}/1 {k}/1 {k}/1" for side, k in (("l", COUNT - 1), ("r", COUNT))]
    (folder / OBJ).write_text("\n".join([*lines, *eyes]))
    used = np.flatnonzero(np.abs(at).sum(axis=1) > 0)
    for number, name in enumerate(sorted(targets())):
        way = np.random.default_rng(number).normal(0, 1, (3, 3)) * ((0, 0, 0), (0, 1, 1), (0, 1, 1))
        way[0, 0] = 1 - number % 3
        moves = 0.08 * at[used] @ way
        for side in ("l-", "r-") if "*" in name else ("",):
            path = folder / "mpfb2/targets" / f"{name.replace('*', side)}.target"
            path.parent.mkdir(parents=True, exist_ok=True)
            rows = zip(used, moves / (2 if "*" in name else 1), strict=True)
            path.write_text("\n".join(f"{k} {x:.5f} {y:.5f} {z:.5f}" for k, (x, y, z) in rows))
    return folder


def targets() -> set[str]:
    """Return the names of all shape targets that sliders mix."""
    names = set()
    for name in ("age", "sex", *toml_table("person.toml")["sliders"]):
        for value in (0, 1) if name == "sex" else (20, 90) if name == "age" else (-1.0, 1.0):
            person = {
                **DEFAULTS,
                "sex": 0.5,
                "age": 50,
                "people": dict.fromkeys(("african", "asian", "caucasian"), 1),
            }
            names |= person_tables({**person, name: value})["targets"].keys()
    return names
