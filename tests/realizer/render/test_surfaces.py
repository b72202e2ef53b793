"""The table of how kinds of surfaces reflect light; and graphics cards compute what the processor does."""

from __future__ import annotations

import re
from importlib.resources import files

import numpy as np
import pytest

from realizer.face.drawn_mesh import CLOTH, EYE, HAIR, SKIN, WET
from realizer.render.lamp_view import SIDE, LampView
from realizer.render.light import preset, presets
from realizer.render.surfaces import (
    COAT,
    REFLECTION,
    SHADED,
    SHARP_SHARE,
    SOFT,
    THROUGH,
    WRAP,
    mirrored_of,
    surfaces,
    uniforms_of,
)  # fmt: skip

COUNT = 400
MAIN = """
uniform sampler2D points;
uniform int kind;
out vec4 light;
vec4 row(int k) { return texelFetch(points, ivec2(k, int(gl_FragCoord.y)), 0); }
void main() {
  light = vec4(
    reflectedBy(kind, row(0).rgb, row(1).xyz, row(2).xyz, row(3).xyz, row(4), row(5).xyz),
    reachOf(row(6).xyz, row(2).xyz)
  );
}
"""


def test_surfaces_have_a_row_for_each_kind():
    assert surfaces().shape == (max(SKIN, EYE, HAIR, WET, CLOTH) + 1, COAT + 1)


def test_surfaces_keep_shares_between_0_and_1():
    rows = surfaces()
    assert ((rows >= 0) & (rows <= 1)).all()
    assert (rows[:, [REFLECTION]] < 0.06).all()
    assert (rows[:, SHARP_SHARE] < 1).all()


def test_surfaces_let_red_reach_furthest_in_skin():
    skin = surfaces()[SKIN]
    assert (np.diff(skin[WRAP:SHADED]) < 0).all()
    assert (np.diff(skin[SOFT:REFLECTION]) < 0).all()
    assert surfaces()[:, THROUGH].argmax() == SKIN


@pytest.fixture
def lamp():
    return LampView(preset().key.direction, (-1, -1, -1), (1, 1, 1))


def test_uniforms_of_a_light_are_those_of_surface_glsl(lamp):
    code = files("realizer.render").joinpath("surface.glsl").read_text()
    lines = re.findall(r"^uniform (?:highp |mediump )?\w+ (.*?);", code, re.MULTILINE)
    declared = {name.split("[")[0].strip() for line in lines for name in line.split(",")}
    maps = {name for name in declared if name.endswith("Map")}
    assert declared - maps == set(uniforms_of(preset(), lamp))


def test_uniforms_of_a_light_map_its_box_to_0_to_1(lamp):
    view = np.reshape(uniforms_of(preset(), lamp)["shadowView"], (4, 4)).T
    assert view[3].tolist() == [0, 0, 0, 1]
    corners = np.float32([[x, y, z, 1] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) @ view.T
    assert ((corners[:, :3] >= 0) & (corners[:, :3] <= 1)).all()
    places = lamp.project(np.float32([[0.1, 0.2, 0.3]]))[0]
    assert view[:3] @ [0.1, 0.2, 0.3, 1] == pytest.approx(places / (SIDE, SIDE, 1), abs=1e-5)


@pytest.fixture(scope="module")
def numbers():
    """Random albedo, three directions, values, direction to the eye and place: (COUNT, 7, 4)."""
    random = np.random.default_rng(5)
    rows = random.random((COUNT, 7, 4), np.float32)
    rows[:, (1, 2, 3, 5), :3] = random.normal(size=(COUNT, 4, 3))
    rows[:, 2, :3] = rows[:, 1, :3] + 0.3 * rows[:, 2, :3]
    rows[:, 5, :3] += 2 * rows[:, 1, :3]
    rows[:, (1, 2, 3, 5), :3] /= np.linalg.norm(rows[:, (1, 2, 3, 5), :3], axis=2)[..., None]
    rows[:, 4, 1] = 0.06 + 0.9 * rows[:, 4, 1]
    rows[:, 6, :3] = rows[:, 6, :3] * 1.2 - 0.6
    return rows


def by_card(rows, kind, light, lamp, depths):
    """Light and share of the key lamp (COUNT, 4), by OpenGL."""
    from realizer.render import opengl

    context = opengl._context()
    with context as gl:
        values = uniforms_of(light, lamp)
        code = "#version 400 core\n" + files("realizer.render").joinpath("surface.glsl").read_text() + MAIN
        program = gl.program(
            vertex_shader="#version 400 core\nin vec2 at; void main() { gl_Position = vec4(at, 0.0, 1.0); }",
            fragment_shader=code,
        )
        textures = {
            "points": gl.texture((7, COUNT), 4, rows.tobytes(), dtype="f4"),
            "mirrorMap": opengl._mirror(gl, mirrored_of(light)),
            "shadowMap": gl.texture(depths.shape, 1, depths.tobytes(), dtype="f4"),
        }
        opengl._give(program, values, tuple(textures))
        program["kind"].value = kind
        for place, texture in enumerate(textures.values()):
            texture.use(place)
        target = gl.framebuffer(gl.renderbuffer((1, COUNT), 4, dtype="f4"))
        target.use()
        corners = gl.buffer(np.float32([-1, -1, 3, -1, -1, 3]).tobytes())
        gl.vertex_array(program, corners, "at").render()
        found = np.frombuffer(target.read(components=4, dtype="f4"), np.float32).reshape(COUNT, 4)
    context.release()
    return found


@pytest.mark.gl("gl")
@pytest.mark.parametrize("name", presets())
@pytest.mark.parametrize("kind", [SKIN, EYE, HAIR, WET, CLOTH])
def test_surface_glsl_is_the_formula_of_the_processor(numbers, kind, name):
    from realizer.render.raster import lights_of
    from realizer.render.shading import mirrored, reflected
    from realizer.render.shadows import ends_around, reach

    light = presets()[name]
    lamp = LampView(light.key.direction, (-1, -1, -1), (1, 1, 1))
    steps = np.random.default_rng(6).random((SIDE // 8, SIDE // 8), np.float32)
    depths = np.ascontiguousarray(np.kron(steps, np.ones((16, 16), np.float32)))
    four = depths.reshape(SIDE, 2, SIDE, 2).transpose(0, 2, 1, 3).reshape(SIDE, SIDE, 4)
    around = np.empty((SIDE, SIDE, 2), np.float32)
    ends_around(np.stack([four.min(axis=2), four.max(axis=2)], axis=2), (0, SIDE), around)
    (lights, levels), row = lights_of(light), surfaces()[kind]
    wanted = []
    for albedo, n, even, strand, values, view, place in numbers:
        normals = tuple(n[:3]), tuple(even[:3]), tuple(strand[:3])
        light_of, towards, share = reflected(
            row, kind == HAIR, kind == EYE, tuple(albedo[:3]), normals, tuple(values), tuple(view[:3]), lights
        )
        seen = np.array(light_of) + share * np.array(mirrored(levels, towards, values[1]))
        wanted.append((*seen, reach((four, around, lamp.matrix), tuple(place[:3]), tuple(even[:3]))))
    found = by_card(numbers, kind, light, lamp, depths)
    assert found == pytest.approx(np.array(wanted), rel=4e-3, abs=2e-3)


@pytest.mark.gl("gl")
@pytest.mark.parametrize(
    "head",
    ["#version 330 core\n", "#version 300 es\nprecision highp float;\nprecision highp sampler2DArray;\n"],
)
def test_surface_glsl_is_valid_on_the_desktop_and_on_the_web(head):
    from realizer.render import opengl

    surface = files("realizer.render").joinpath("surface.glsl").read_text()
    vertex, inputs = (head + code.split("\n", 1)[1] for code in (opengl.VERTEX, opengl.HEAD))
    context = opengl._context()
    with context as gl:
        program = gl.program(vertex_shader=vertex, fragment_shader=inputs + surface + opengl.DRAW)
        assert "albedoMap" in program
    context.release()
