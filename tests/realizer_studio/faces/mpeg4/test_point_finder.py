"""Tests of the automatic placement of feature points."""

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from realizer.cli.faces import faces
from realizer.core.errors import FaceError
from realizer.face.features import NAMES
from realizer.face.load import folder_of, list_faces, load_face
from realizer_studio.faces.check import check_face
from realizer_studio.faces.mpeg4.fap_scores import mean_score, score_faps
from realizer_studio.faces.mpeg4.point_finder import find_points

FACES = [info.name for info in list_faces()]
BENT: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "as it is": lambda at: at,
    "long and narrow": lambda at: at * [0.92, 1.08, 1.0],
    "a giant elsewhere": lambda at: at * 1.6 + [0.4, 1.7, -0.2],
    "a longer chin": lambda at: at + np.clip(-at[:, 1:2] - 0.065, 0, None) * [0, -0.3, 0],
}


@pytest.mark.parametrize("name", FACES)
@pytest.mark.parametrize("bent", BENT)
def test_find_points_on_every_face_and_on_bent_ones(name: str, bent: str) -> None:
    face = load_face(name)
    at = BENT[bent](face.vertices.astype(float))
    unit = np.ptp(at[face.parts["skin"][0] : face.parts["skin"][1], 0]) / 0.17
    found, guesses = find_points(at, face.triangles, face.parts)
    assert sorted(found) == sorted(NAMES)
    marked = {key: BENT[bent](place[None].astype(float))[0] for key, place in face.points.items()}
    off = {key: float(np.linalg.norm(np.array(found[key].place) - marked[key])) / unit for key in NAMES}
    sure = [off[key] for key in NAMES if key not in guesses]
    assert len(sure) > 30
    assert np.mean(sure) < 0.002
    assert np.mean(list(off.values())) < 0.005


@pytest.mark.parametrize("name", FACES)
def test_find_points_is_sure_of_lips_and_lids(name: str) -> None:
    face = load_face(name)
    found, guesses = find_points(face.vertices.astype(float), face.triangles, face.parts)
    assert not {"2.2", "2.3", "8.1", "8.2", "3.1", "3.2", "3.3", "3.4", "9.3"} & set(guesses)
    for above, below in (("2.2", "2.3"), ("2.6", "2.8"), ("3.1", "3.3"), ("8.1", "8.2"), ("9.15", "8.1")):
        assert found[above].y >= found[below].y - 3e-4


@pytest.mark.slow
def test_zones_command_marks_a_bare_mesh_and_lists_guesses(tmp_path: Path) -> None:
    bare = tmp_path / "bare"
    bare.mkdir()
    for file in folder_of("default").iterdir():
        if file.name in ("face.toml", "mesh.npz") or file.suffix == ".webp":
            shutil.copy(file, bare)
    runner = CliRunner(env={"REALIZER_FACES": str(tmp_path)})
    ran = runner.invoke(faces, ["zones", "bare", "-o", str(tmp_path / "made")])
    assert ran.exit_code == 0, ran.output
    assert "guessed, look at them:" in ran.output
    assert check_face("made", tmp_path) == ()
    assert mean_score(score_faps(load_face("made", tmp_path))) > 2.7


def test_find_points_refuses_a_head_that_looks_away() -> None:
    face = load_face()
    turned = face.vertices.astype(float) * [-1, 1, -1]
    with pytest.raises(FaceError, match="wanted the left one at the larger x"):
        find_points(turned, face.triangles, face.parts)
    with pytest.raises(FaceError, match="wanted 'left_eye'"):
        find_points(face.vertices.astype(float), face.triangles, {"skin": face.parts["skin"]})
