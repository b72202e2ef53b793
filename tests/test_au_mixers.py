"""Tests of the mixers of action units that deformers are compared with."""

import numpy as np
import pytest

from realizer.face.au.file import read_model
from realizer.face.au.model import Model
from realizer.face.load import list_faces, load_face
from tests.au_mixers import additive, mix, successive


@pytest.fixture(scope="module")
def model() -> Model:
    path = next(info.path for info in list_faces() if info.name == load_face().name)
    return read_model(path / "au_published.toml")


@pytest.fixture(scope="module")
def skin() -> np.ndarray:
    first, last = load_face().parts["skin"]
    return load_face().vertices[first:last].astype(np.float64)


def part(name: str) -> np.ndarray:
    first, last = load_face().parts[name]
    return load_face().vertices[first:last].astype(np.float64)


def test_additive_does_not_depend_on_the_order(model: Model, skin: np.ndarray) -> None:
    one, other = additive(model, skin, {12: 1, 25: 0.7}), additive(model, skin, {25: 0.7, 12: 1})
    assert one == pytest.approx(other, abs=1e-15)
    assert one - skin == pytest.approx(
        model.displacement(12, skin) + 0.7 * model.displacement(25, skin), abs=1e-15
    )


def test_successive_depends_on_the_order(model: Model, skin: np.ndarray) -> None:
    one, other = successive(model, skin, {12: 1, 27: 1}), successive(model, skin, {27: 1, 12: 1})
    assert np.abs(one - other).max() > 0.001


def test_mix_adds_displacements_of_the_face(model: Model, skin: np.ndarray) -> None:
    values = {1: 0.5, 12: 1.0, 25: 0.8}
    assert mix(model, skin, values) == pytest.approx(additive(model, skin, values), abs=1e-12)


def test_mix_of_nothing_moves_nothing(model: Model, skin: np.ndarray) -> None:
    assert (mix(model, skin, {}) == skin).all()
    assert mix(model, skin, {12: 0.0, 51: 0.0}) == pytest.approx(skin, abs=1e-15)


def test_mix_turns_a_head_as_one_rigid_body(model: Model) -> None:
    """Eyes and upper teeth keep their distances; a linear displacement would not."""
    points = np.concatenate([part("left_eye"), part("upper_teeth")])
    turned = mix(model, points, {51: 1.0, 54: 0.5}, "fixed")
    pairs = np.random.default_rng(1).integers(0, len(points), (200, 2)).T
    apart = [np.linalg.norm(at[pairs[0]] - at[pairs[1]], axis=1) for at in (points, turned)]
    assert apart[1] == pytest.approx(apart[0], abs=1e-4)
    assert np.abs(turned - points).max() > 0.03


@pytest.mark.parametrize(
    ("au", "axis", "sign"),
    [(51, 0, 1), (52, 0, -1), (53, 1, 1), (54, 1, -1), (61, 0, 1), (62, 0, -1), (63, 1, 1), (64, 1, -1)],
)
def test_mix_turns_eyes_in_the_direction_of_their_unit(model: Model, au: int, axis: int, sign: int) -> None:
    """Left is the character's, +x; the front of the eyeball shows it."""
    ball = part("left_eye")
    front = ball[np.argmax(ball[:, 2])][None]
    moved = mix(model, front, {au: 1.0}, "left eye") - front
    assert sign * moved[0, axis] > 0.003


@pytest.mark.parametrize(("au", "sign"), [(55, 1), (56, -1)])
def test_mix_tilts_a_head_to_its_side(model: Model, skin: np.ndarray, au: int, sign: int) -> None:
    top = skin[np.argmax(skin[:, 1])][None]
    assert sign * (mix(model, top, {au: 1.0}) - top)[0, 0] > 0.05


def test_mix_turns_by_half_the_angle_at_half_the_intensity(model: Model) -> None:
    """Equation 4.2: where a point goes is not linear in the intensity."""
    ball = part("right_eye")
    half, whole = (mix(model, ball, {61: value}, "right eye") for value in (0.5, 1.0))
    assert mix(model, half, {61: 0.5}, "right eye") == pytest.approx(whole, abs=1e-12)
    assert np.abs((half - ball) * 2 - (whole - ball)).max() > 1e-4


def test_mix_turns_the_head_with_eyes_that_look(model: Model) -> None:
    ball = part("left_eye")
    looks = mix(model, ball, {61: 1.0}, "left eye")
    assert mix(model, ball, {51: 1.0, 61: 1.0}, "left eye") == pytest.approx(
        mix(model, looks, {51: 1.0}, "fixed"), abs=1e-6
    )


def test_mix_moves_the_lower_teeth_with_the_jaw_only(model: Model) -> None:
    teeth = part("lower_teeth")
    dropped = mix(model, teeth, {27: 1.0}, "jaw") - teeth
    front = teeth[:, 2] > teeth[:, 2].max() - 0.015
    assert (dropped[front, 1] < -0.008).all()
    assert (dropped[:, 1] < -0.006).all()  # those at the back are nearer to the hinge
    assert (mix(model, teeth, {12: 1.0, 25: 1.0}, "jaw") == teeth).all()
    assert (mix(model, part("upper_teeth"), {27: 1.0}, "fixed") == part("upper_teeth")).all()


def test_mix_keeps_the_chin_of_an_open_jaw_on_a_turning_head(model: Model) -> None:
    chin = np.asarray(load_face().points["2.1"], np.float64)[None]
    opened = mix(model, chin, {27: 1.0})
    both = mix(model, chin, {27: 1.0, 51: 1.0})
    pivot = np.array(model.head.pivot)
    assert np.linalg.norm(both - pivot) == pytest.approx(float(np.linalg.norm(opened - pivot)), rel=0.02)
