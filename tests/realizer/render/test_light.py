"""Tests of the lights."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.core.colours import linear, srgb
from realizer.core.errors import RenderError
from realizer.render.light import preset, presets, unit

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
