"""Tests of lights and the shader."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.core.colours import linear, srgb
from realizer.core.errors import RenderError
from realizer.render.light import Shader, preset, presets, unit

FRONT = np.array([0, 0, 1], np.float32)
SKIN = (206, 158, 132)


def shade(normal, colour=SKIN, occlusion=1.0, gloss=0.0, light="portrait"):
    shader = Shader(
        preset(light),
        np.array([colour], np.uint8),
        np.array([occlusion], np.float32),
        np.array([gloss], np.float32),
        FRONT,
    )
    return shader(unit(normal)[None])[0]


def formula(normal, colour, occlusion, gloss):
    """The docstring of `Light`, word for word."""
    light = preset()
    n, v = unit(normal).astype(float), FRONT.astype(float)

    def lamp(lamp):
        wrap = np.array(lamp.wrap)
        return np.array(lamp.colour) * np.maximum(0, (n @ unit(lamp.direction) + wrap) / (1 + wrap))

    edge = lamp(light.rim) * (1 - max(0, n @ v)) ** light.rim_power
    half = (1 + n[1]) / 2
    ambient = (np.array(light.ground) * (1 - half) + np.array(light.sky) * half) * occlusion
    reach = 1 - light.shadow * (1 - occlusion)
    power = light.dull * (light.sharp / light.dull) ** gloss
    facing = max(0, n @ unit(unit(light.key.direction) + v))
    shine = gloss * light.highlight * facing**power * np.array(light.key.colour)
    albedo = linear(np.array(colour, np.uint8))
    x = albedo * ((lamp(light.key) + lamp(light.fill) + edge) * reach + ambient) + shine * reach
    knee = light.knee
    return srgb(np.where(x < knee, x, 1 - (1 - knee) * np.exp(-(x - knee) / (1 - knee))))


directions = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1)


@given(
    normal=directions,
    colour=st.tuples(*[st.integers(0, 255)] * 3),
    occlusion=st.floats(0, 1),
    gloss=st.sampled_from([0.0, 0.2, 0.7, 1.0]),
)
def test_shader_equals_the_published_formula(normal, colour, occlusion, gloss):
    assert shade(normal, colour, occlusion, gloss) == pytest.approx(
        formula(normal, colour, occlusion, gloss), abs=1.5 / 255
    )


def test_shader_brightens_the_side_towards_the_key():
    key = preset().key.direction
    assert (shade(key) > shade((-key[0], key[1], key[2]))).all()


def test_shader_keeps_colour_on_the_shaded_side():
    """Not a grey zombie: away from the key, skin is still warm and well above black."""
    red, green, blue = shade((0.9, -0.2, 0.4))
    assert red > green > blue
    assert red > 0.3


@pytest.mark.parametrize("light", list(presets()))
@pytest.mark.parametrize("colour", [(206, 158, 132), (240, 205, 185), (90, 58, 42)])
def test_shader_burns_out_no_skin(colour, light):
    around = [(x, y, 1.0) for x in np.linspace(-1, 1, 9) for y in np.linspace(-1, 1, 9)]
    brightest = np.max([shade(n, colour, light=light) for n in around], axis=0)
    assert brightest[0] < 0.985
    assert brightest[2] < brightest[0] - 0.02


def test_shader_highlights_glossy_eyes_and_no_dull_skin():
    half = unit(unit(preset().key.direction) + FRONT)
    aside = unit(half + np.array([0.5, 0, 0], np.float32))
    assert shade(half, (40, 30, 25), gloss=1.0).min() > shade(aside, (40, 30, 25), gloss=1.0).max() + 0.4
    assert shade(half, (40, 30, 25)).max() - shade(aside, (40, 30, 25)).min() < 0.2


def test_shader_darkens_hidden_corners():
    assert (shade(FRONT, occlusion=0.2) < shade(FRONT, occlusion=1.0) - 0.1).all()


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
        for name in presets()
    }
    assert 0.97 < contrast["daylight"] < contrast["portrait"] < contrast["evening"]


def test_preset_reads_the_variable(monkeypatch):
    monkeypatch.setenv("REALIZER_LIGHT", "evening")
    assert preset() == preset("evening") != preset("portrait")
    monkeypatch.delenv("REALIZER_LIGHT")
    assert preset() == preset("portrait")
