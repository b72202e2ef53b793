"""Films of our faces with painted markers, and their true places: 31 dots, two of them painted lids."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw

from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.render.cameras import camera_for
from realizer.render.renderer import Renderer
from realizer_studio.tracking.markers.layout import Layout, wojdel
from realizer_studio.tracking.pictures import Picture

SIZE = (720, 576)
CAMERA = "close"
GREEN, BLUE = (60, 190, 80), (50, 80, 200)
RADIUS = 4.0  # pixels of a dot
LID = (13.0, 3.5)  # half the width and height of a painted lid
SHADE = 0.25  # how much darker dots at the side are
STALE = 25  # frames for which the face below the markers is drawn once, as drawing is slow
SPELL = 5  # frames for which a dot is hidden, on average


@cache
def vertices_of(name: str) -> tuple[int, ...]:
    """Return the vertex of a face at each point of the layout: the foremost one near it."""
    face, layout = load_face(name), wojdel()
    marked = [(k, fp) for k, fp in enumerate(layout.feature_points) if fp]
    places = np.array([face.points[fp][:2] for _, fp in marked], np.float64)
    ones = np.ones((len(layout), 1))
    shown = np.hstack([layout.positions, ones])[[k for k, _ in marked]]
    wanted = np.hstack([layout.positions, ones]) @ np.linalg.lstsq(shown, places, rcond=None)[0]
    at = np.asarray(face.vertices, np.float64)
    found = []
    for k, place in enumerate(wanted):
        if fp := layout.feature_points[k]:
            found.append(face.feature_points[fp])
        else:
            away = np.linalg.norm(at[:, :2] - place, axis=1)
            near = np.flatnonzero(away < max(0.003, np.sort(away)[3]))
            found.append(int(near[at[near, 2].argmax()]))
    return tuple(found)


def truth(name: str, faps: np.ndarray, size: tuple[int, int] = SIZE) -> np.ndarray:
    """Return the true pixels (n, 31, 2) of the markers for FAPs (n, 68)."""
    face = load_face(name)
    camera = camera_for(face, CAMERA)
    found = []
    for first in range(0, len(faps), 256):
        places = deform(face, np.asarray(faps[first : first + 256], np.float32))[:, list(vertices_of(name))]
        pixels, _ = camera.project(places.reshape(-1, 3), size)
        found.append(pixels.reshape(*places.shape[:2], 2))
    pixels = np.concatenate(found)
    pixels[:, wojdel().colours == 1, 1] -= 2 * LID[1]  # the paint is above the lashes
    return pixels


def hidden(frames: int, share: float, seed: int) -> np.ndarray:
    """Return which dots (n, 31) are hidden, in spells."""
    chance = np.random.default_rng(seed)
    found = np.zeros((frames, 31), bool)
    while share and found.mean() < share:
        k, first, length = chance.integers(31), chance.integers(frames), 1 + chance.poisson(SPELL - 1)
        found[first : first + length, k] = True
    return found


def paint(picture: Image.Image, pixels: np.ndarray, gone: np.ndarray) -> Image.Image:
    """Return a picture with markers at pixels (31, 2), apart from hidden ones; three times as fine inside."""
    fine = 3
    layer = Image.new("RGBA", (picture.width * fine, picture.height * fine))
    pen = ImageDraw.Draw(layer)
    half = np.ptp(pixels[:, 0]) / 2
    for k in np.flatnonzero(~gone):
        x, y = pixels[k]
        side = abs(x - pixels[:, 0].mean()) / half
        light = 1 - SHADE * side
        lid = wojdel().colours[k] == 1
        wide, tall = LID if lid else (RADIUS * (1 - 0.3 * side), RADIUS)
        y += tall if lid else 0.0  # of the lid, the upper edge is the place
        colour = tuple(int(light * value) for value in (BLUE if lid else GREEN))
        box = [
            (x - wide + 0.5) * fine,
            (y - tall + 0.5) * fine,
            (x + wide + 0.5) * fine,
            (y + tall + 0.5) * fine,
        ]
        pen.ellipse(box, fill=(*colour, 255))
    layer = layer.resize(picture.size, Image.Resampling.BOX)
    return Image.alpha_composite(picture.convert("RGBA"), layer).convert("RGB")


def plain(places: np.ndarray, gone: np.ndarray | None = None) -> Iterator[Picture]:
    """Yield pictures of nothing but skin and markers at pixels (n, 31, 2)."""
    for k, pixels in enumerate(places):
        skin = Image.new("RGB", SIZE, (196, 150, 125))
        away = np.zeros(len(pixels), bool) if gone is None else gone[k]
        yield Picture(k / 25, paint(skin, pixels, away), f"picture {k}")


def acted(frames: int = 30) -> np.ndarray:
    """Return FAPs (n, 68) of raised brows and an open mouth, which come and go."""
    faps = np.zeros((frames, 68))
    wave = np.sin(np.linspace(0, 2 * np.pi, frames))
    for fap, value in {31: 160, 32: 160, 33: 150, 34: 150, 35: 140, 36: 140}.items():
        faps[:, fap - 1] = value * np.maximum(wave, 0)
    for fap, value in {3: 200, 52: -200, 57: -160, 58: -160, 53: -60, 54: -60}.items():
        faps[:, fap - 1] = value * np.maximum(-wave, 0)
    return faps


def pictures(name: str, faps: np.ndarray, gone: np.ndarray) -> Iterator[Image.Image]:
    """Yield the pictures of a face with markers for FAPs (n, 68)."""
    places = truth(name, faps)
    with Renderer(name, SIZE, CAMERA) as renderer:
        for k, picture in enumerate(renderer.frames(np.asarray(faps[::STALE], np.float32))):
            below = Image.fromarray(np.array(picture))
            part = slice(STALE * k, STALE * (k + 1))
            for pixels, away in zip(places[part], gone[part], strict=True):
                yield paint(below, pixels, away)


def write_film(path: Path, name: str, faps: np.ndarray, gone: np.ndarray, fps: int = 25) -> None:
    """Write a film as a camera would, compressed."""
    import av

    with av.open(str(path), "w") as file:
        stream = file.add_stream("libx264", rate=fps, options={"preset": "veryfast", "crf": "18"})
        stream.width, stream.height, stream.pix_fmt = *SIZE, "yuv420p"
        for picture in pictures(name, faps, gone):
            file.mux(stream.encode(av.VideoFrame.from_image(picture)))
        file.mux(stream.encode())


def layout_in_pixels(name: str) -> Layout:
    """Return the layout where a face at rest has it, y up."""
    return wojdel().with_positions(truth(name, np.zeros((1, 68)))[0] * (1, -1))
