"""Tests of the light from all around."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer import tables
from realizer.core.errors import RenderError
from realizer.render.environment import HEIGHT, LEVELS, WIDTH, Environment, environment_of
from realizer.render.light import presets
from tests.benchmarks.environments import directions_of

AXES = np.vstack([np.eye(3), -np.eye(3)]).astype(np.float32)


def uniform(value: float) -> Environment:
    sh = np.zeros((9, 3), np.float32)
    sh[0] = value
    return Environment(sh, np.full((LEVELS, HEIGHT, WIDTH, 3), value, np.float32))


def solid_angles() -> np.ndarray:
    edges = np.cos(np.linspace(0, np.pi, HEIGHT + 1))
    return np.repeat((edges[:-1] - edges[1:]) * 2 * np.pi / WIDTH, WIDTH)


@pytest.mark.parametrize("name", presets())
def test_environment_of_each_light_agrees_with_its_own_panorama(name):
    """The harmonics are the cosine's sums over the mirror's level, and every level holds the same light."""
    environment = environment_of(name)
    directions, solid = directions_of(HEIGHT, WIDTH).reshape(-1, 3), solid_angles()
    light = environment.levels.reshape(LEVELS, -1, 3)
    summed = (np.maximum(AXES @ directions.T, 0) * solid) @ light[0] / np.pi
    assert environment.irradiance(AXES) == pytest.approx(summed, abs=0.06 * summed.max())
    means = np.einsum("knc,n->kc", light, solid) / (4 * np.pi)
    assert means == pytest.approx(np.repeat(means[:1], LEVELS, axis=0), rel=0.02)
    assert (np.diff(np.ptp(light, axis=1).mean(1)) < 0).all()  # rougher is softer


def test_radiance_of_a_uniform_sky_is_uniform():
    directions = directions_of(7, 9).reshape(-1, 3)
    roughness = np.linspace(0, 1, len(directions), dtype=np.float32)
    assert uniform(0.3).radiance(directions, roughness) == pytest.approx(0.3)
    assert uniform(0.3).irradiance(directions) == pytest.approx(0.3)


def test_radiance_at_texels_is_the_table():
    environment, directions = environment_of("portrait"), directions_of(HEIGHT, WIDTH).reshape(-1, 3)
    for level in range(LEVELS):
        roughness = np.full(len(directions), level / (LEVELS - 1), np.float32)
        table = environment.levels[level].reshape(-1, 3)
        assert environment.radiance(directions, roughness) == pytest.approx(table, abs=2e-3)


def test_radiance_is_continuous_behind_the_head():
    behind = np.array([[1e-4, 0.2, -1], [-1e-4, 0.2, -1]], np.float32)
    left, right = environment_of("outdoors").radiance(behind, np.zeros(2, np.float32))
    assert left == pytest.approx(right, rel=1e-3)


def test_environment_of_outdoors_is_brightest_towards_its_sun():
    environment = environment_of("outdoors")
    sun, away = environment.irradiance(np.array([[0.6, 0.3, 0.74], [-0.6, 0.3, -0.74]], np.float32))
    assert sun[0] > 2 * away[0]
    assert sun[0] / sun[2] > 1.5 * away[0] / away[2]  # and it is warm, the shade blue


def test_environment_of_an_unknown_light_says_what_is_missing():
    with pytest.raises(RenderError, match="light noon: wanted its environment"):
        environment_of("noon")


def test_environments_are_small():
    assert (Path(tables.__file__).parent / "environments.npz").stat().st_size < 400_000
