"""`reflected`: light that a surface sends to the eye keeps the laws of light."""

import numpy as np
import pytest

from realizer.face.drawn_mesh import CLOTH, EYE, HAIR, SKIN, WET
from realizer.render.shading import BRIGHTEST, STEPS, exp2, log2, mirrored, reflected, tone_curve, unit
from realizer.render.surfaces import REFLECTION, SHADED, surfaces

pytestmark = [pytest.mark.gl("onboard"), pytest.mark.xdist_group("render")]
FRONT, SIDE, BACK = (np.float32([0, 0, 1]), np.float32([1, 0, 0]), np.float32([0, 0, -1]))
WHITE, GREY = np.float32([1, 1, 1]), np.float32([0.2, 0.2, 0.2])


def light(kind=CLOTH, normal=FRONT, view=FRONT, albedo=GREY, key=FRONT, around=0.0, sky=0.0, values=None):
    lamps = np.zeros((2, 2, 3), np.float32)
    lamps[0] = unit(key), WHITE
    lamps[1, 0] = BACK
    sh = np.zeros((9, 3), np.float32)
    sh[0] = around
    levels = np.full((5, 32, 32, 3), sky, np.float32)
    values = values or (1.0, 0.5, 1.0, 1.0)
    lights = lamps, sh, np.float32(2), np.float32([1, 0.1])
    normals = tuple(normal), tuple(normal), (np.float32(0), np.float32(1), np.float32(0))
    numbers = tuple(np.float32(v) for v in values)
    row = surfaces()[kind]
    sent, towards, share = reflected(
        row, kind == HAIR, kind == EYE, tuple(albedo), normals, numbers, tuple(view), lights
    )
    return np.array(sent) + share * np.array(mirrored(levels, towards, numbers[1]))


@pytest.mark.slow
def test_reflected_light_of_an_even_room_is_the_albedo():
    dark = np.array(light(key=BACK, around=0.5))
    assert dark == pytest.approx(0.5 * GREY, rel=0.02)


def test_reflected_light_falls_off_from_the_lamp():
    turned = [light(normal=np.float32([np.sin(a), 0, np.cos(a)]))[0] for a in np.linspace(0, np.pi / 2, 9)]
    assert (np.diff(turned) < 0).all()


@pytest.mark.parametrize("kind", [SKIN, EYE, HAIR, CLOTH])
def test_reflected_light_is_less_in_shadow_and_in_cavities(kind):
    whole = light(kind, values=(1, 0.5, 1, 1))
    assert (light(kind, values=(1, 0.5, 1, 0)) < whole).all()
    assert (light(kind, values=(0.2, 0.5, 1, 1)) < whole).all()


def test_reflected_light_scatters_into_shadow_of_surfaces_that_are_open():
    lit, shaded, hidden = (light(WET, values=(open_, 0.5, 1, s)) for open_, s in ((1, 1), (1, 0), (0.1, 0)))
    assert shaded == pytest.approx(surfaces()[WET, SHADED] * lit)
    assert (hidden < 0.2 * shaded).all()


def test_reflected_light_of_skin_reaches_further_in_red():
    red, green, blue = light(SKIN, normal=SIDE, view=unit((np.float32(1), np.float32(0), np.float32(1))))
    assert red > green > blue


def test_reflected_light_comes_through_thin_skin():
    thick, thin = (light(SKIN, key=BACK, values=(1, 0.5, t, 1)) for t in (1, 0))
    assert thin[0] > thick[0] + 0.05
    assert thin[0] > 2 * thin[2]


def test_reflected_light_of_a_smooth_surface_mirrors_the_room():
    room = light(EYE, key=BACK, sky=1.0, albedo=0 * GREY, values=(1, 0.1, 1, 0))
    assert room == pytest.approx(surfaces()[EYE][REFLECTION], abs=0.01)
    grazing = light(EYE, normal=FRONT, view=unit((np.float32(1), np.float32(0), np.float32(0.1))), key=BACK,
                    sky=1.0, albedo=0 * GREY, values=(1, 0.1, 1, 0))  # fmt: skip
    assert (grazing > 5 * room).all()


def test_reflected_light_of_hair_is_brightest_across_the_strand():
    shine = [light(HAIR, key=np.float32([0, np.sin(a), np.cos(a)]))[0] for a in (0.0, 0.9)]
    assert shine[0] > shine[1]


def test_reflected_light_of_an_eye_shows_the_lamp_as_a_disc():
    clear = (1.0, 0.1, 1.0, 1.0)
    lit, aside = (light(EYE, normal=unit(np.float32([x, 0, 1])), values=clear) for x in (0, 0.15))
    assert (lit - aside > 1).all()
    key = unit(np.float32([1, 0, 1]))
    assert light(EYE, normal=unit(key + FRONT), key=key, values=clear)[0] > 1
    assert (light(EYE) < lit - 0.8).all()


def test_exp2_and_log2_are_those_of_numpy():
    for x in np.linspace(-130, 4, 1000, dtype=np.float32):
        assert exp2(x) == pytest.approx(np.exp2(max(x, -126)), rel=1e-5)
    for x in np.geomspace(1e-6, 4, 1000, dtype=np.float32):
        assert log2(x) == pytest.approx(np.log2(x), abs=2e-4)
    assert log2(np.float32(0)) < -126


def test_tone_curve_rises_to_white():
    curve = tone_curve()
    assert curve[0] == 0
    assert (np.diff(curve) >= 0).all()
    assert curve[-1] == pytest.approx(255, abs=1)
    grey = curve[int(np.sqrt(0.18 / BRIGHTEST) * (STEPS - 1))]
    assert 100 < grey < 150
