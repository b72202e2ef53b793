"""A face driven by its action unit model: the same as the mixers, in one product."""

from pathlib import Path

import numpy as np
import pytest

from realizer.errors import FaceError
from realizer.face import list_faces, load_face
from realizer.face.au import Deformer, load_deformer, mix

FOLDER = next(info.path for info in list_faces() if info.name == load_face().name)


@pytest.fixture(scope="module")
def deformer() -> Deformer:
    found = load_deformer(model=FOLDER / "au_published.toml")
    assert found is not None
    return found


def part(vertices: np.ndarray, name: str) -> np.ndarray:
    return vertices[slice(*load_face().parts[name])]


def test_at_rest_the_face_is_neutral_to_the_last_bit(deformer: Deformer) -> None:
    assert (deformer(np.zeros((2, len(deformer.columns)))) == deformer.face.vertices).all()


def test_each_unit_has_a_column_for_each_side_it_has(deformer: Deformer) -> None:
    assert {"12L", "12R", "17", "51", "64"} <= set(deformer.columns)
    assert len(deformer.columns) == len(set(deformer.columns))
    assert {int(name.rstrip("LR")) for name in deformer.columns} == {
        *deformer.model.units,
        *deformer.model.degrees,
    }


def test_it_gives_what_the_mixers_give(deformer: Deformer) -> None:
    values = {1: 0.6, 12: 0.9, 27: 0.5, 51: 0.4, 54: 0.3, 61: 0.7}
    made = deformer(deformer.row(values)[None])[0]
    neutral = deformer.face.vertices.astype(np.float64)
    for name, thing in (
        ("hair", "face"),
        ("left_eye", "left eye"),
        ("right_eye", "right eye"),
        ("lower_teeth", "jaw"),
        ("upper_teeth", "fixed"),
    ):
        wanted = mix(deformer.model, part(neutral, name), values, thing)  # type: ignore[arg-type]
        assert part(made, name) == pytest.approx(wanted, abs=5e-5), name


def test_lashes_and_brows_stay_on_the_skin_they_grow_on(deformer: Deformer) -> None:
    """Half closed and closed, raised and lowered, nothing comes loose by more than a millimetre."""
    from scipy.spatial import cKDTree

    neutral = deformer.face.vertices
    skin = part(neutral, "skin")
    for values in ({43: 1.0}, {43: 0.5}, {1: 1.0, 2: 1.0}, {4: 1.0}):
        made = deformer(deformer.row(values)[None])[0]
        for name in ("brows", "lashes"):
            before = np.asarray(cKDTree(skin).query(part(neutral, name))[0])
            after = np.asarray(cKDTree(part(made, "skin")).query(part(made, name))[0])
            assert (after - before).max() < 0.001, (values, name)


def test_a_smile_on_the_left_leaves_the_right_alone(deformer: Deformer) -> None:
    row = np.zeros((1, len(deformer.columns)))
    row[0, deformer.columns.index("12L")] = 1
    moved = deformer(row)[0] - deformer.face.vertices
    face = deformer.face
    left, right = (face.feature_points[key] for key in ("8.3", "8.4"))
    assert np.linalg.norm(moved[left]) > 0.008
    assert np.linalg.norm(moved[right]) < 1e-6


def test_closed_eyes_cover_their_balls(deformer: Deformer) -> None:
    made = deformer(deformer.row({43: 1.0})[None])[0]
    lid = deformer.face.basis["lid"]
    centres = np.array(deformer.model.eyes)[deformer.face.basis["lid_eye"]]
    away = np.linalg.norm(made[lid] - centres, axis=1)
    assert (away > deformer.face.basis["lid_radius"] - 2e-5).all()


def test_an_open_jaw_parts_the_lips_everywhere_between_the_corners(deformer: Deformer) -> None:
    """The lips' two sides are told apart by the mesh, so that no vertex stays behind on the wrong one."""
    from realizer.face.au.mouth import halves

    face = deformer.face
    made = deformer(deformer.row({27: 1.0})[None])[0]
    index, upper = halves(face)
    inner = np.abs(face.vertices[index, 0]) < 0.015
    fall = (made - face.vertices)[index, 1]
    assert fall[inner & upper].min() > -0.012
    lips = inner & ~upper & (np.abs(face.vertices[index, 1] - face.points["2.3"][1]) < 0.006)
    assert fall[lips].max() < -0.012


def test_values_of_another_shape_or_not_finite_are_refused(deformer: Deformer) -> None:
    with pytest.raises(ValueError, match=r"wanted \(n, "):
        deformer(np.zeros((1, 3)))
    with pytest.raises(ValueError, match="finite"):
        deformer(np.full((1, len(deformer.columns)), np.nan))


def test_a_face_chooses_its_deformer_by_a_key(tmp_path: Path) -> None:
    import shutil

    assert load_deformer() is None  # off by default
    folder = Path(shutil.copytree(FOLDER, tmp_path / "mine"))
    head = (folder / "face.toml").read_text()
    (folder / "face.toml").write_text('deformer = "au"\n' + head)
    assert load_deformer("mine", tmp_path) is not None
    (folder / "face.toml").write_text('deformer = "bones"\n' + head)
    with pytest.raises(FaceError, match="wanted mpeg4 or au, got 'bones'"):
        load_deformer("mine", tmp_path)
