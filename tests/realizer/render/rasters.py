"""Small meshes drawn by the raster, for tests."""

from __future__ import annotations

import io

import numpy as np
from PIL import Image

from realizer.face.drawn_mesh import CLOTH, DrawnMesh
from realizer.render.lamp_view import LampView
from realizer.render.raster import Raster
from realizer.render.textures import texels_of

SIZE = (60, 40)


def numbers(values):
    """Numbers in tuples, as float32."""
    return tuple(map(numbers, values)) if isinstance(values, tuple) else np.float32(values)


RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
SEEN = 232  # the tone curve's byte of white light
NO_LAMP = ((0.0,) * 3, (0.0,) * 3)
LIGHTS = (
    numbers(((NO_LAMP, NO_LAMP), ((1.0,) * 3, *[(0.0,) * 3] * 8), 2.0, (1.0, 0.1))),
    np.zeros((5, 32, 32, 3), np.float32),
)


def raster_of(triangles, colours, size=SIZE, uv=None, maps=None, **flags):
    count, none = len(colours), np.zeros(len(triangles), bool)
    mesh = DrawnMesh(
        places=None, strands=None, ups=None,
        triangles=np.asarray(triangles, np.int32),
        uv=np.zeros((count, 2), np.float32) if uv is None else np.float32(uv),
        colours=np.zeros((count, 3), np.uint8),
        occlusion=np.ones(count, np.float32),
        gloss=np.zeros(count, np.float32),
        kind=np.full(count, flags.get("kind", CLOTH), np.uint8),
        parts={}, two_sided=flags.get("two_sided", none), see_through=flags.get("see_through", none),
    )  # fmt: skip
    lamp = LampView((0, 1, 1), (-1, -1, -1), (1, 1, 1))
    return Raster(size, mesh, np.float32(colours), maps or texels_of(None), lamp)


def picture_of(raster, points, near, eye=(0, 0, 100), pixel=0.01, fold=0.0):
    """The picture of points (n, 2) in pixels, all facing the camera and far from the shadows' box."""
    points = np.asarray(points, float)
    moving = np.zeros((len(points), 10), np.float32)
    moving[:, :2], moving[:, 5] = points * (pixel, -pixel), 1
    moving[:, 6] = fold
    return raster(points, near, moving, LIGHTS, np.float32(eye)).copy()


def draw(corners, colours, nearness=1.0, size=SIZE, **flags):
    """Triangles of (n, 3, 2) pixels, each of one colour and nearness."""
    corners = np.asarray(corners, float).reshape(-1, 2)
    count = len(corners) // 3
    tones = np.repeat(np.broadcast_to(colours, (count, 3)), 3, axis=0)
    near = np.repeat(np.broadcast_to(nearness, count), 3).astype(np.float32)
    return picture_of(raster_of(np.arange(3 * count).reshape(-1, 3), tones, size, **flags), corners, near)


def webp(picture):
    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, "webp", lossless=True)
    return stream.getvalue()


BIG = [(5.0, 5.0), (5.0, 35.0), (55.0, 20.0)]  # counter-clockwise, seen with y up
