"""Tests of the lights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer import tables
from realizer.core.colours import linear, srgb
from realizer.core.errors import RenderError
from realizer.render.light import HEIGHT, LEVELS, WIDTH, Environment, environment_of, preset, presets, unit
from training.environments import directions_of

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


SKINS = [(206, 158, 132), (240, 205, 185), (90, 58, 42)]


def shade(normal, colour=SKINS[0], light="portrait"):
    """Return the sRGB colour 0..1 of a dull surface that nothing hides."""
    chosen, n = preset(light), unit(normal)
    key = np.array(chosen.key.colour) * max(0, n @ unit(chosen.key.direction))
    x = (
        chosen.exposure
        * linear(np.array(colour, np.uint8))
        * (key + chosen.environment.irradiance(n[None])[0])
    )
    return srgb(x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14))


@pytest.mark.parametrize("light", list(presets()))
def test_light_is_brighter_on_the_side_of_the_key(light):
    x, y, z = preset(light).key.direction
    assert (shade((x, y, z), light=light) > shade((-x, y, z), light=light)).all()


@pytest.mark.parametrize("light", list(presets()))
def test_light_keeps_colour_on_the_shaded_side(light):
    x, _, z = preset(light).key.direction
    red, green, blue = shade((-x, -0.2, z), light=light)
    assert red > green > blue
    assert red > 0.25


@pytest.mark.parametrize("light", list(presets()))
@pytest.mark.parametrize("colour", SKINS)
def test_light_burns_out_no_skin(colour, light):
    around = [(x, y, 1.0) for x in np.linspace(-1, 1, 9) for y in np.linspace(-1, 1, 9)]
    brightest = np.max([shade(n, colour, light) for n in around], axis=0)
    assert brightest[0] < 0.95
    assert brightest[2] < brightest[0] - 0.02


def test_preset_lists_the_lights_for_another_name():
    assert list(presets()) == ["portrait", "daylight", "evening", "studio", "outdoors"]
    with pytest.raises(
        RenderError, match="wanted one of portrait, daylight, evening, studio, outdoors, got 'noon'"
    ):
        preset("noon")


def test_presets_daylight_is_even_and_evening_is_not():
    """Cheek to cheek: what the key's side has over the other."""
    contrast = {
        name: shade((-0.7, 0, 0.7), light=name).mean() / shade((0.7, 0, 0.7), light=name).mean()
        for name in ("daylight", "portrait", "evening")
    }
    assert 1 < contrast["daylight"] < contrast["portrait"] < contrast["evening"]


def test_preset_reads_the_variable(monkeypatch):
    monkeypatch.setenv("REALIZER_LIGHT", "evening")
    assert preset() == preset("evening") != preset("portrait")
    monkeypatch.delenv("REALIZER_LIGHT")
    assert preset() == preset("portrait")
