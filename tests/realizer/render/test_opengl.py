"""Tests of the OpenGL backend, whose context lives in this process here."""

from __future__ import annotations

import io
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cache
from itertools import cycle

import numpy as np
import pytest
from PIL import Image

from realizer.face.cards import Cards
from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.face.maps import Maps
from realizer.face.surface import normals
from realizer.render.cameras import PRESETS, camera_for
from realizer.render.light import preset, presets
from realizer.render.opengl import OpenGLCanvas
from tests.shipped import FACES

pytestmark = [pytest.mark.gl("gl"), pytest.mark.xdist_group("render")]

SIZE = (320, 240)


@pytest.fixture(scope="module")
def canvases(balls) -> Iterator[Callable[[tuple[int, int]], OpenGLCanvas]]:
    """Canvases by size."""
    face, _ = balls
    opened = []

    @cache
    def canvas_of(size: tuple[int, int]) -> OpenGLCanvas:
        opened.append(OpenGLCanvas(face, size, camera_for(face), preset()))
        return opened[-1]

    yield canvas_of
    for canvas in opened:
        canvas.close()


@pytest.fixture
def canvas(canvases) -> OpenGLCanvas:
    return canvases(SIZE)


def skin(picture):
    """Where it is warm: the backdrop is blue-grey."""
    return picture[..., 0].astype(int) > picture[..., 2].astype(int) + 15


def test_opengl_canvas_draws_the_projected_silhouette(canvas, balls):
    face, normals = balls
    picture = canvas.draw(face.vertices, normals)
    assert picture.shape == (240, 320, 3)
    rows, columns = np.nonzero(skin(picture))
    outline = camera_for(face).project(face.vertices, SIZE)[0]
    assert rows.min() == pytest.approx(outline[:, 1].min(), abs=2)
    assert rows.max() == pytest.approx(outline[:, 1].max(), abs=2)
    assert columns.min() == pytest.approx(outline[:, 0].min(), abs=2)
    assert columns.max() == pytest.approx(outline[:, 0].max(), abs=2)


def test_opengl_canvas_draws_the_eyes_where_they_project(canvas, balls):
    face, normals = balls
    picture = canvas.draw(face.vertices, normals)
    for x, y in camera_for(face).project([[0.032, 0, 0], [-0.032, 0, 0]], SIZE)[0].round().astype(int):
        assert picture[y, x].min() > 170


def test_opengl_canvas_follows_the_vertices(canvas, balls):
    face, normals = balls
    still = canvas.draw(face.vertices, normals)
    moved = canvas.draw(face.vertices + np.float32([0.02, 0, 0]), normals)
    shift = camera_for(face).project([[0.02, 0, -0.05], [0, 0, -0.05]], SIZE)[0][:, 0]
    centre = [np.nonzero(skin(p))[1].mean() for p in (still, moved)]
    assert centre[1] - centre[0] == pytest.approx(shift[0] - shift[1], abs=1.5)
    assert np.array_equal(canvas.draw(face.vertices, normals), still)


def test_opengl_canvas_is_lit_from_the_upper_left(canvas, balls):
    face, normals = balls
    picture = canvas.draw(face.vertices, normals).astype(float).sum(2)
    where = skin(canvas.draw(face.vertices, normals))
    rows, columns = np.nonzero(where)
    left = columns < columns.mean()
    upper = rows < rows.mean()
    brightness = picture[rows, columns]
    assert brightness[left & upper].mean() > brightness[~left & upper].mean() + 20
    assert brightness[left & upper].mean() > brightness[left & ~upper].mean() + 20


def test_opengl_canvas_smooths_edges(canvas, balls):
    """MSAA x4: along the outline there are tones between skin and backdrop."""
    face, normals = balls
    picture = canvas.draw(face.vertices, normals)
    row = picture[100, :, 0].astype(int)
    step = np.abs(np.diff(row))
    assert step.max() < 120
    between = canvas.draw(face.vertices + np.float32([0.0003, 0, 0]), normals)
    assert not np.array_equal(between, picture)


def test_opengl_canvas_has_a_soft_neutral_backdrop(canvas, balls):
    face, normals = balls
    picture = canvas.draw(face.vertices, normals).astype(int)
    corner, beside = picture[2, 2], picture[90, 40]
    assert (beside > corner).all()
    assert np.ptp(corner) < 20
    assert np.abs(np.diff(picture[:, 3].sum(1))).max() < 30


def test_opengl_canvas_draws_into_the_given_memory(canvas, balls):
    face, normals = balls
    out = np.zeros((240, 320, 3), np.uint8)
    assert canvas.draw(face.vertices, normals, out) is out
    assert np.array_equal(out, canvas.draw(face.vertices, normals))


def test_opengl_canvas_does_not_shear_odd_sizes(canvases, balls):
    """Rows of 3 x 101 bytes are no multiple of four, GL's default row alignment."""
    face, normals = balls
    picture = canvases((101, 77)).draw(face.vertices, normals)
    columns = np.nonzero(skin(picture))[1]
    assert columns.mean() == pytest.approx(50, abs=1)


def encoded(pixels):
    stream = io.BytesIO()
    Image.fromarray(np.rint(pixels).clip(0, 255).astype(np.uint8)).save(stream, "webp", lossless=True)
    return stream.getvalue()


def noise(seed, low, high):
    """Soft random tones (256, 256)."""
    coarse = np.random.default_rng(seed).uniform(low, high, (24, 24)).astype(np.float32)
    return np.array(Image.fromarray(coarse).resize((256, 256), Image.Resampling.BICUBIC))


def fringe(face):
    """Cards of 6 x 45 mm that hang over the forehead in two layers, with strands from the maps' corner."""
    x, layer = (n.ravel() for n in np.meshgrid(np.linspace(-0.05, 0.05, 20), [0.002, 0.006]))
    corners = np.array([[-0.003, 0.045], [-0.003, 0], [0.003, 0], [0.003, 0.045]])
    points = np.zeros((len(x), 4, 3))
    points[..., :2] = np.stack([x, 0.02 + 30 * layer**2], axis=1)[:, None] + corners
    points[..., 2] = layer[:, None] + 0.01 - 6 * points[..., 0] ** 2
    count = 4 * len(x)
    # Each point is an affine combination of four vertices far apart.
    extremes = face.vertices.argmin(axis=0), face.vertices.argmax(axis=0)
    roots = np.array([extremes[0][0], extremes[1][0], extremes[1][1], extremes[0][2]])
    frame = np.column_stack([face.vertices[roots], np.ones(4)]).T
    weights = np.linalg.solve(frame, np.column_stack([points.reshape(-1, 3), np.ones(count)]).T).T
    first = 4 * np.arange(len(x), dtype=np.int32)[:, None]
    return Cards(
        roots=np.tile(roots, (count, 1)).astype(np.int32),
        weights=weights.astype(np.float32),
        ups=np.tile(np.float32([0, 0, 0, -1]), (count, 1)),  # forwards
        triangles=(first[:, None] + np.int32([[0, 1, 2], [0, 2, 3]])).reshape(-1, 3),
        uv=np.tile(np.float32([[0.76, 0.01], [0.76, 0.24], [0.99, 0.24], [0.99, 0.01]]), (len(x), 1)),
        colours=np.tile(np.uint8([120, 80, 50]), (count, 1)),
        occlusion=np.ones(count, np.float32),
        gloss=np.zeros(count, np.float32),
        parts={"hair": (0, count)},
    )


@pytest.fixture(scope="module")
def mapped(balls):
    """The head of three balls with maps and cards, and its normals."""
    face, ups = balls
    albedo = np.stack([*(noise(k, 170, 255) for k in range(3)), np.full((256, 256), 255)], axis=2)
    albedo[:64, 192:, 3] = np.arange(64) // 16 % 2 * np.linspace(300, 60, 64)[:, None]
    surface = np.stack([noise(4, 200, 255), noise(5, 100, 180), noise(6, 0, 255)], axis=2)
    files = {"albedo": encoded(albedo), "relief": encoded(noise(7, 90, 166)), "surface": encoded(surface)}
    corners = face.vertices[face.triangles]
    uv = np.stack([0.35 + corners[..., 0] * 4, 0.5 - corners[..., 1] * 3], axis=2).astype(np.float32)
    none = np.zeros(len(uv), bool), np.zeros((len(face.vertices), 0), np.float32)
    return replace(face, maps=Maps(files, uv, 0.001, 8e-5, *none), cards=fringe(face)), ups


def differences(face, shape, camera, light, size=(512, 512)):
    """How far apart pictures by OpenGL and by the processor are where both are opaque, (n, 3) 0..255."""
    from realizer.render.raster import SoftwareCanvas

    pictures = []
    for kind in (OpenGLCanvas, SoftwareCanvas):
        canvas = kind(face, size, camera_for(face, camera), preset(light), "transparent")
        pictures.append(canvas.draw(*shape).astype(int))
        canvas.close()
    whole = (pictures[0][..., 3] == 255) & (pictures[1][..., 3] == 255)
    assert whole.mean() > 0.1
    # The outline is the same but for single hairs.
    assert np.abs(pictures[0][..., 3] - pictures[1][..., 3]).mean() < 1.6
    return np.abs(pictures[0] - pictures[1])[whole][:, :3]


@pytest.mark.parametrize(("camera", "light"), [("front", "portrait"), ("profile", "studio")])
def test_opengl_canvas_agrees_with_the_processor(mapped, camera, light):
    face, ups = mapped
    assert differences(face, (face.vertices, ups), camera, light).mean() < 3


@pytest.mark.slow
@pytest.mark.parametrize(("camera", "light"), list(zip(cycle(PRESETS), presets(), strict=False)))
@pytest.mark.parametrize("name", FACES)
def test_opengl_canvas_agrees_with_the_processor_on_people(name, camera, light):
    """The skin is most of what is opaque in these pictures."""
    face = load_face(name)
    row = np.zeros((1, len(face.inputs)), np.float32)
    row[0, 2] = 300  # an open jaw
    vertices = deform(face, row)
    assert differences(face, (vertices[0], normals(face, vertices)[0]), camera, light).mean() < 3
