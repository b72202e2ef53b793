"""Tests of the smooth warp of a person to photographs."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer_studio.faces.photo.photo_fit import Fit, Observation
from realizer_studio.faces.photo.shape import LandmarkAnchors, Pose, Sliders
from realizer_studio.faces.photo.warp import WARP, Warp, read_warp, warp_of
from tests.realizer_studio.faces.photo.test_photo_fit import SCALE, view


@pytest.fixture(scope="module")
def fitted(data: Path) -> tuple[Fit, np.ndarray, np.ndarray]:
    """A fit, its mesh, and the mesh of which its pictures are: the chin of the latter juts out."""
    places = LandmarkAnchors.of("front"), LandmarkAnchors.of("side")
    sliders = Sliders(data, {}, np.concatenate([part.corners for part in places]))
    at = sliders.mesh(sliders.person(np.zeros(len(sliders.names))))
    true = at + 0.008 * np.exp(-((at[:, 1:2] - at[:, 1].min()) ** 2) / 0.04**2) * (0, -0.5, 1)
    poses = (Pose(np.zeros(3), SCALE, np.zeros(2)), Pose(np.array([0, 0.8, 0]), SCALE, np.zeros(2)))
    sights = tuple(
        Observation(view(np.zeros((468, 2)), 0), part, pose(part.positions(true))[0])
        for part, pose in zip(places, poses, strict=True)
    )
    return Fit({}, sights, poses), at, true


def test_warp_moves_the_face_to_where_the_pictures_show_it(
    fitted: tuple[Fit, np.ndarray, np.ndarray],
) -> None:
    fit, at, true = fitted
    places = fit.observations[0].anchors
    before = np.linalg.norm(places.positions(at) - places.positions(true), axis=1)
    after = np.linalg.norm(places.positions(warp_of(fit, at)(at)) - places.positions(true), axis=1)
    assert before.max() > 0.006
    assert after.max() < 0.7 * before.max()
    assert after.mean() < 0.6 * before.mean()


def test_warp_is_alike_on_both_sides_and_leaves_what_is_far(
    fitted: tuple[Fit, np.ndarray, np.ndarray],
) -> None:
    fit, at, _ = fitted
    warp = warp_of(fit, at)
    some = np.array([[0.02, -0.06, 0.0], [0.0, -0.8, 0.0]])
    one, other = warp(some), warp(some * (-1, 1, 1))
    assert one == pytest.approx(other * (-1, 1, 1), abs=5e-4)
    assert one[1].tolist() == some[1].tolist()


def test_warp_is_read_as_it_was_written(tmp_path: Path) -> None:
    assert read_warp(tmp_path) is None
    warp = Warp(np.eye(3), np.eye(3) / 100)
    warp.write(tmp_path)
    found = read_warp(tmp_path)
    assert found is not None
    assert found.moves.tolist() == warp.moves.tolist()
    (tmp_path / WARP).write_bytes(b"no archive")
    with pytest.raises(FaceError, match=WARP):
        read_warp(tmp_path)
