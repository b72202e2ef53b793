"""Tests of the deformer by action units, together with FAPs, gaze and speech."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer.face.au.deformer import limit_opening
from realizer.face.deform import deform
from realizer.face.load import input_names, list_faces, load_face
from realizer.face.model import Face
from tests.au_mixers import mix

FOLDER = next(info.path for info in list_faces() if info.name == load_face().name)


@pytest.fixture(scope="module")
def face() -> Face:
    return load_face(deformer="au")


def pose(face: Face, **values: float) -> np.ndarray:
    """A row: au12=1 (both sides), au12L=1, or a FAP by its name."""
    row = np.zeros(len(face.inputs), np.float32)
    for key, value in values.items():
        name = key.removeprefix("au")
        for column in (name, f"{name}L", f"{name}R"):
            if column in face.inputs:
                row[face.inputs.index(column)] = value
    return row


def shown(face: Face, **values: float) -> np.ndarray:
    made: np.ndarray = deform(face, pose(face, **values)[None])[0].astype(np.float64)
    return made


def part(face: Face, vertices: np.ndarray, name: str) -> np.ndarray:
    return vertices[slice(*face.parts[name])]


def test_moves_at_rest_keep_the_neutral_face(face: Face) -> None:
    assert (deform(face, np.zeros((2, len(face.inputs)))) == face.vertices).all()


def test_columns_are_faps_units_lips_and_mixing(face: Face) -> None:
    assert face.inputs[:68] == load_face(deformer="mpeg4").inputs
    assert {"12L", "12R", "17", "45L", "46R"} <= set(face.inputs[68:])
    mixing = face.inputs.index("lips")
    assert face.inputs[mixing + 1 : mixing + 4] == ("successive", "rank 1", "rank 2")
    assert face.inputs[-1] == "rank 28"
    assert len(set(face.inputs)) == len(face.inputs)
    assert input_names(deformer="au") == face.inputs


def test_moves_equal_the_reference_mixer(face: Face) -> None:
    values = {1: 0.6, 12: 0.9, 27: 0.5}
    made = shown(face, **{f"au{au}": value for au, value in values.items()})
    neutral = face.vertices.astype(np.float64)
    assert face.model is not None
    for name, thing in (
        ("left_eye", "left eye"),
        ("lower_teeth", "jaw"),
        ("upper_teeth", "fixed"),
    ):
        wanted = mix(face.model, part(face, neutral, name), values, thing)  # type: ignore[arg-type]
        assert part(face, made, name) == pytest.approx(wanted, abs=5e-5), name


def test_moves_leave_faps_alone(face: Face) -> None:
    rows = np.zeros((1, 68), np.float32)
    rows[0, [2, 11, 22, 30, 48]] = 400, 200, 20000, 150, 30000
    other = load_face(deformer="mpeg4")
    assert np.array_equal(deform(face, rows), deform(other, rows))


def test_moves_turn_with_the_head(face: Face) -> None:
    """Mixed successively: the smile first, then the turn of all of it."""
    turned = shown(face, head_yaw=30000)
    both = shown(face, au12=1, head_yaw=30000)
    straight = shown(face, au12=1)
    corner = face.feature_points["8.3"]
    before, after = straight[corner] - face.vertices[corner], both[corner] - turned[corner]
    assert np.linalg.norm(after) == pytest.approx(np.linalg.norm(before), rel=0.02)
    assert np.linalg.norm(after - before) > 0.1 * np.linalg.norm(before)


def test_moves_keep_lashes_and_brows_on_the_skin(face: Face) -> None:
    """Half closed and closed, raised and lowered, nothing comes loose by more than 2.5 millimetres."""
    from scipy.spatial import cKDTree

    skin, cards = part(face, face.vertices, "skin"), face.cards
    assert cards is not None
    for values in ({"au43": 1.0}, {"au43": 0.5}, {"au1": 1.0, "au2": 1.0}, {"au4": 1.0}):
        made = shown(face, **values)
        for name in ("brows", "lashes"):
            mine = slice(*cards.parts[name])
            roots, shares = cards.roots[mine], cards.weights[mine, :, None]
            rest, moved = ((shares * vertices[roots]).sum(axis=1) for vertices in (face.vertices, made))
            before = np.asarray(cKDTree(skin).query(rest)[0])
            after = np.asarray(cKDTree(part(face, made, "skin")).query(moved)[0])
            assert (after - before).max() < 0.0025, (values, name)


def test_moves_of_one_side_leave_the_other(face: Face) -> None:
    moved = shown(face, au12L=1) - face.vertices
    left, right = (face.feature_points[key] for key in ("8.3", "8.4"))
    assert np.linalg.norm(moved[left]) > 0.008
    assert np.linalg.norm(moved[right]) < 1e-6


def test_moves_are_successive_if_a_pose_says_so(face: Face) -> None:
    """By rank, and as they are numbered where ranks do not tell them apart; what is rigid does not care."""
    summed = shown(face, au12=1, au25=1)
    chained = shown(face, au12=1, au25=1, successive=1)
    turned = shown(face, au12=1, au25=1, successive=1, **{"rank 25": 0.5})
    assert np.linalg.norm(chained - summed, axis=1).max() > 0.001
    assert np.linalg.norm(chained - turned, axis=1).max() > 0.001
    assert np.array_equal(chained, shown(face, au12=1, au25=1, successive=1, **{"rank 12": 0.5}))
    both = {"rank 25": 0.9, "rank 12": 0.8}
    assert np.array_equal(turned, shown(face, au12=1, au25=1, successive=1, **both))
    for name in ("upper_teeth", "left_eye", "lower_teeth"):
        assert np.array_equal(part(face, chained, name), part(face, summed, name)), name


def test_moves_of_one_unit_are_the_same_for_both_mixers(face: Face) -> None:
    smile = shown(face, au12=0.7)
    assert shown(face, au12=0.7, successive=1) == pytest.approx(smile, abs=2e-5)
    both = shown(face, au12=1, au25=1)
    assert np.array_equal(both, shown(face, au12=1, au25=1, **{"rank 25": 1}))


def test_moves_between_the_mixers_are_interpolated(face: Face) -> None:
    ends = [shown(face, au12=1, au25=1, successive=share) for share in (0, 1)]
    off = np.abs(shown(face, au12=1, au25=1, successive=0.5) - np.mean(ends, axis=0))
    assert np.mean(off > 1e-6) < 0.005  # but for lining that the teeth push out
    assert off.max() < 2e-4


def test_moves_close_the_lids_with_either_mixer(face: Face) -> None:
    made = shown(face, au43=1, au4=1, au6=1, au7=1, successive=1)
    apart = made[face.feature_points["3.1"], 1] - made[face.feature_points["3.3"], 1]
    assert -0.0003 < apart < 0.002


def test_moves_cover_the_balls_of_closed_eyes(face: Face) -> None:
    made = shown(face, au43=1)
    lid, basis = face.basis["lid"], face.basis
    centres = np.stack([centre for _, centre in basis["eyes"]])[basis["lid_eye"]]
    away = np.linalg.norm(made[lid] - centres, axis=1)
    assert (away > basis["lid_radius"] - 2e-5).all()


def test_moves_close_lids_without_crossing(face: Face) -> None:
    made = shown(face, au43=1)
    for upper, lower in (("3.1", "3.3"), ("3.2", "3.4")):
        apart = made[face.feature_points[upper], 1] - made[face.feature_points[lower], 1]
        assert -0.0003 < apart < 0.002


@pytest.mark.parametrize(
    "also",
    [{"au5": 1.0}, {"au7": 1.0}, {"au6": 1.0, "au7": 1.0}, {"close_t_l_eyelid": 470.0}],
    ids=["wide", "tightened", "squinting", "looking down"],
)
def test_moves_keep_closed_lids_closed(face: Face, also: dict[str, float]) -> None:
    closed, other = shown(face, au43=1), shown(face, au43=1, **also)
    for point in ("3.1", "3.3"):
        vertex = face.feature_points[point]
        assert np.linalg.norm(other[vertex] - closed[vertex]) < 0.0008, point


def test_moves_of_blink_and_wink_close_the_eye(face: Face) -> None:
    closed = shown(face, au43L=1)
    assert np.array_equal(shown(face, au45L=1), closed)
    assert np.array_equal(shown(face, au46L=1, au45L=0.5, au43L=1), closed)


def test_moves_of_an_open_jaw_part_the_whole_lips(face: Face) -> None:
    """The lips' two sides are distinguished by the mesh, so that no vertex stays behind on the wrong one."""
    from realizer.face.au.regions import halves

    made = shown(face, au27=1)
    index, upper = halves(face)
    inner = np.abs(face.vertices[index, 0]) < 0.015
    fall = (made - face.vertices)[index, 1]
    assert fall[inner & upper].min() > -0.012
    lips = inner & ~upper & (np.abs(face.vertices[index, 1] - face.points["2.3"][1]) < 0.006)
    assert fall[lips].max() < -0.012


def test_limit_opening_opens_as_far_as_the_widest_unit(face: Face) -> None:
    wide = shown(face, au27=1)
    for also in ({"au26": 1.0}, {"au25": 1.0}, {"au25": 0.7, "au26": 0.9}):
        assert shown(face, au27=1, **also) == pytest.approx(wide, abs=1e-6)
    assert face.model is not None
    gaps = np.array([face.model.gap(au) for au in (27, 26, 25)])
    values = np.random.default_rng(0).uniform(0, 1, (3, 50))
    assert gaps @ limit_opening(gaps, values) == pytest.approx((gaps[:, None] * values).max(axis=0))


def test_moves_leave_the_lips_to_speech(face: Face) -> None:
    values = {"au1": 1.0, "au6": 1.0, "au12": 1.0, "au27": 1.0}
    silent = shown(face, **values) - face.vertices
    speaking = shown(face, **values, lips=1) - face.vertices
    for point, least, most in (("2.3", 0, 0.12), ("8.3", 0.1, 0.7), ("4.1", 1, 1), ("5.3", 0.5, 1)):
        here = face.feature_points[point]
        part_of = np.linalg.norm(speaking[here]) / np.linalg.norm(silent[here])
        assert least - 1e-3 <= part_of <= most + 1e-3, point
    teeth = slice(*face.parts["lower_teeth"])
    assert np.abs(speaking[teeth]).max() < 1e-6
    assert np.abs(silent[teeth]).max() > 0.01


def test_deform_refuses_wrong_shapes_and_infinity(face: Face) -> None:
    with pytest.raises(ValueError, match=r"wanted \(n, 68\) or \(n, "):
        deform(face, np.zeros((1, 3)))
    with pytest.raises(ValueError, match="finite"):
        deform(face, np.full((1, len(face.inputs)), np.nan))


@pytest.fixture
def mine(tmp_path: Path) -> Path:
    return Path(shutil.copytree(FOLDER, tmp_path / "mine"))


def say(folder: Path, words: str) -> None:
    head = (FOLDER / "face.toml").read_text()
    (folder / "face.toml").write_text(f"{words}\n" + head)


def test_load_face_selects_the_deformer(mine: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def units(deformer: str | None = None) -> bool:
        return load_face("mine", mine.parent, deformer).model is not None

    assert (units(), units("au"), units("mpeg4")) == (False, True, False)
    monkeypatch.setenv("REALIZER_DEFORMER", "au")
    assert (units(), units("mpeg4")) == (True, False)


def test_load_face_uses_the_model_that_face_toml_names(mine: Path) -> None:
    say(mine, 'deformer = "au"')
    assert load_face("mine", mine.parent).model is not None
    assert load_face("mine", mine.parent, "mpeg4").model is None


def test_load_face_may_leave_units_to_the_faps(mine: Path) -> None:
    say(mine, 'deformer = { name = "au", model = "au_published.toml", aus = [1, 2, 12] }')
    face = load_face("mine", mine.parent)
    assert face.inputs[68:75] == ("1L", "1R", "2L", "2R", "12L", "12R", "lips")
    assert face.inputs[75:] == ("successive", "rank 1", "rank 2", "rank 12")
    assert face.model is not None
    assert face.model.form == "published"


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ('deformer = "bones"', "wanted mpeg4 or au, got 'bones'"),
        ('deformer = { name = "au", model = "../x.toml" }', "wanted the name of a file beside it"),
        ('deformer = { name = "au", model = "none.toml" }', "realizer faces fit mine"),
        ('deformer = { name = "au", aus = [1, 51] }', r"got \[1, 51\]"),
    ],
)
def test_load_face_refuses_an_unusable_deformer(mine: Path, words: str, says: str) -> None:
    say(mine, words)
    with pytest.raises(FaceError, match=says):
        load_face("mine", mine.parent)


def test_load_face_explains_how_to_make_a_model(mine: Path) -> None:
    (mine / "au_extended.toml").unlink()
    assert load_face("mine", mine.parent).model is None
    with pytest.raises(FaceError, match="realizer faces fit mine"):
        load_face("mine", mine.parent, "au")
    with pytest.raises(FaceError, match="wanted mpeg4 or au, got 'bones'"):
        load_face("mine", mine.parent, "bones")
