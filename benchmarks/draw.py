"""Measures the time of pictures in ms per frame, and of films in frames per second.

python benchmarks/draw.py [--face NAME] [--size 512x512] [--way auto] [--frames 60]
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as in the drawing process

import numpy as np
from stopwatch import median, noise

from realizer.core.array_types import Float32
from realizer.face.deform import deform
from realizer.face.drawn_mesh import drawn_mesh
from realizer.face.load import load_face
from realizer.face.surface import normals
from realizer.outputs.film import FORMATS, RATE, encode_film
from realizer.render.cameras import camera_for
from realizer.render.drawing_process import unavailable_reason
from realizer.render.light import preset
from realizer.render.opengl import OpenGLCanvas
from realizer.render.raster import SoftwareCanvas
from realizer.render.renderer import Renderer
from realizer.render.worker import BACKENDS, encode

# Spoken by the silent voice in about ten seconds.
TEXT = (
    '<bml id="b"><speech id="s"><text>Hello there, how are you today? I am a face that can be told what to '
    "say, when to say it, and how to look while I am saying it, which takes about ten seconds.</text>"
    '</speech><faceLexeme id="f" lexeme="SMILE" start="s:start" end="s:end"/></bml>'
)


def film(face: str, size: str) -> tuple[float, float]:
    """Return elapsed and processor seconds from a text to its film by the command line, with its start."""
    with tempfile.TemporaryDirectory() as folder:
        command = [sys.executable, "-m", "realizer", "realize", "-", "-q", "--voice", "silent"]
        command += ["--face", face, "--size", size, "-o", str(Path(folder) / "x.mp4")]
        begin, before = time.perf_counter(), resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run(command, input=TEXT, text=True, check=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - begin, spent


def by_processor(canvas: SoftwareCanvas, vertices: Float32, normals: Float32) -> list[tuple[str, float]]:
    """Return the ms of the steps of a picture by the processor."""
    raster = canvas._raster
    whole = median(lambda: canvas.draw(vertices, normals), 30)
    moving = canvas._moving
    points, distances = canvas._camera.project(moving[:, :3], canvas._size)
    near = (1 / distances).astype(np.float32)

    def see(rows: tuple[int, int]) -> None:
        raster.front.keys[rows[0] : rows[1]] = 0
        raster.front.fill(points, near, rows)

    moved = median(lambda: canvas._mesh(vertices, normals, canvas._folds(vertices)), 30)
    shadow = median(lambda: raster._shadow_map(moving), 30)
    seen = median(lambda: list(raster._pool.map(see, raster.front.bands)), 30)
    rest = whole - moved - shadow - seen
    return [("mesh", moved), ("shadow", shadow), ("visibility", seen), ("light", rest), ("all", whole)]


def by_opengl(canvas: OpenGLCanvas, vertices: Float32, normals: Float32) -> list[tuple[str, float]]:
    """Return the ms of the steps of a picture by OpenGL, whose passes are left out one after the other."""
    whole = median(lambda: canvas.draw(vertices, normals), 30)
    canvas._drawing = []
    shadow = median(lambda: canvas.draw(vertices, normals), 30)
    canvas._casting = []
    rest = median(lambda: canvas.draw(vertices, normals), 30)
    light = whole - shadow
    return [("mesh, transfer", rest), ("shadow", shadow - rest), ("visibility, light", light), ("all", whole)]


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("--face", default="default")
    options.add_argument("--size", default="512x512")
    options.add_argument("--way", default="auto", choices=BACKENDS)
    options.add_argument("--frames", type=int, default=60)
    chosen = options.parse_args()
    width, height = (int(n) for n in chosen.size.split("x"))
    size = (width, height)
    face = load_face(chosen.face)
    rows = np.zeros((chosen.frames, 68), np.float32)
    rows[:, 2] = 300 + 300 * np.sin(np.arange(len(rows)) / 3)
    rows[:, 48] = 8000 * np.sin(np.arange(len(rows)) / 7)
    print(noise())
    print(f"{face.name}: {len(face.vertices)} vertices, {len(face.triangles)} triangles, {width}x{height}")

    def line(name: str, ms: float) -> None:
        print(f"{name:42} {ms:7.2f} ms")

    camera = camera_for(face)
    batch = rows[:16]
    vertices = deform(face, batch)
    ups = normals(face, vertices)
    line("deform, a frame of a batch of 16", median(lambda: deform(face, batch), 20) / 16)
    line("normals, likewise", median(lambda: normals(face, vertices), 20) / 16)
    line("deform and normals, one frame alone", median(lambda: normals(face, deform(face, rows[:1])), 40))
    mesh = drawn_mesh(face)
    print(f"drawn: {len(mesh.uv)} vertices, {len(mesh.triangles)} triangles")
    own = SoftwareCanvas(face, size, camera, preset())
    for step, ms in by_processor(own, vertices[0], ups[0]):
        line(f"by the processor: {step}", ms)
    picture = own.draw(vertices[0], ups[0])
    if (missing := unavailable_reason("gl")) is None:
        canvas = OpenGLCanvas(face, size, camera, preset())
        for step, ms in by_opengl(canvas, vertices[0], ups[0]):
            line(f"by OpenGL: {step}", ms)
        canvas.close()
    else:
        print(f"by OpenGL: {missing}")
    for form in ("jpeg", "png", "webp"):
        line(f"written as {form}", median(lambda form=form: encode(picture, form, 85), 20))

    with Renderer(chosen.face, size, backend=chosen.way) as renderer:
        line("Renderer.encoded, JPEG of one row, all of it", median(lambda: renderer.encoded(rows[0]), 40))
        each = median(lambda: renderer.draw(rows), 3) / len(rows)
        line("Renderer.draw, a frame of a long call", each)
        for suffix, form in FORMATS.items():
            with tempfile.TemporaryDirectory() as folder:
                path = Path(folder) / f"film{suffix}"
                sound = np.zeros(RATE, np.int16)
                ms = median(
                    lambda path=path, form=form, sound=sound: encode_film(
                        path, form, renderer.frames(rows), len(rows), 25.0, sound
                    ),
                    3,
                )
            print(f"{'film ' + suffix + ', all of it':42} {1000 * len(rows) / ms:7.1f} frames a second")
    wall, spent = min(film(chosen.face, chosen.size) for _ in range(3))
    print(f"{'text to film of 10 s, from start to end':42} {wall:7.2f} s, of processors {spent:.2f} s")


if __name__ == "__main__":
    main()
