"""Tests of the renderer and its drawing process."""

from __future__ import annotations

import io
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import realizer
from realizer.core.errors import RealizerError, RenderError
from realizer.render import drawing_process
from realizer.render.renderer import Renderer
from tests.pictures import drawn_here

pytestmark = pytest.mark.xdist_group("render")

SIZE = (96, 80)


def rows(count: int) -> np.ndarray:
    out = np.zeros((count, 68), np.float32)
    out[:, 48] = np.linspace(0, 30000, count)  # head_yaw: every picture differs
    return out


@pytest.fixture(scope="module")
def renderer() -> Iterator[Renderer]:
    with Renderer("default", SIZE) as renderer:
        yield renderer


@pytest.mark.gl
@pytest.mark.slow
def test_renderer_draws_many_pictures_in_order(renderer):
    """More rows than the shared memory holds: each slot is drawn several times."""
    pictures = renderer.draw(rows(41))
    assert pictures.shape == (41, 80, 96, 3)
    assert pictures.dtype == np.uint8
    for k in (0, 7, 8, 15, 16, 40):
        assert np.array_equal(renderer.draw(rows(41)[k : k + 1])[0], pictures[k])
    assert len({picture.tobytes() for picture in pictures}) > 35


@pytest.mark.gl
def test_renderer_draws_nothing_for_no_rows(renderer):
    assert renderer.draw(np.zeros((0, 68), np.float32)).shape == (0, 80, 96, 3)


@pytest.mark.gl
def test_renderer_encodes_the_same_picture_as_jpeg(renderer):
    (picture,) = renderer.draw(rows(1))
    encoded = np.asarray(Image.open(io.BytesIO(renderer.encoded(rows(1)[0], quality=95))))
    assert encoded.shape == (80, 96, 3)
    assert np.abs(encoded.astype(int) - picture).mean() < 3
    assert len(renderer.encoded(rows(1)[0], quality=20)) < len(renderer.encoded(rows(1)[0], quality=95))


@pytest.mark.gl
@pytest.mark.parametrize("left_after", [1, 8, 9, 30])
def test_renderer_drops_pictures_that_nobody_takes(renderer, left_after):
    pictures = renderer.frames(rows(41))
    for _ in range(left_after):
        next(pictures)
    pictures.close()
    before = renderer.pid
    assert np.array_equal(renderer.draw(rows(41)[20:21])[0], renderer.draw(rows(41))[20])
    assert renderer.pid == before


@pytest.mark.gl
@pytest.mark.parametrize("call", ["draw", pytest.param("jpeg", marks=pytest.mark.slow)])
def test_renderer_replaces_a_killed_process_after_one_error(call):
    with Renderer("default", SIZE) as renderer:
        first = renderer.draw(rows(1))
        killed = renderer.pid
        os.kill(killed, signal.SIGKILL)
        with pytest.raises(RenderError, match=r"ended .*-9.*; the next call starts a new one"):
            renderer.draw(rows(1)) if call == "draw" else renderer.encoded(rows(1)[0])
        assert np.array_equal(renderer.draw(rows(1)), first)
        assert renderer.pid != killed


def test_renderer_ends_a_process_that_does_not_answer(monkeypatch):
    monkeypatch.setattr(drawing_process, "PATIENCE", 0)
    with Renderer("default", SIZE) as renderer:
        renderer.start()
        pid = renderer.pid
        with pytest.raises(RenderError) as caught:  # the error refers to the process, which has to end first
            renderer.draw(rows(1))
        with pytest.raises(ProcessLookupError):
            os.kill(pid, 0)
        assert "no picture within 0 s" in str(caught.value)


@pytest.mark.gl
def test_renderer_serves_two_threads_one_after_the_other(renderer):
    wanted = renderer.draw(rows(6))
    got: dict[int, np.ndarray] = {}

    def work(k: int) -> None:
        for _ in range(3):
            got[k] = renderer.draw(rows(6)[k : k + 1])[0]

    threads = [threading.Thread(target=work, args=(k,)) for k in (0, 5)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert np.array_equal(got[0], wanted[0])
    assert np.array_equal(got[5], wanted[5])


@pytest.mark.gl
@pytest.mark.slow
def test_renderer_close_ends_the_process():
    renderer = Renderer("default", SIZE)
    assert renderer.pid is None
    renderer.draw(rows(1))
    pid = renderer.pid
    renderer.close()
    renderer.close()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


@pytest.mark.gl
@pytest.mark.slow
def test_renderer_draws_with_the_process_that_start_made(renderer):
    with Renderer("default", SIZE) as early:
        early.start()
        started = early.pid
        early.start()
        assert np.array_equal(early.draw(rows(3)), renderer.draw(rows(3)))
        assert early.pid == started


def test_renderer_start_without_a_picture_leaves_nothing():
    with Renderer("default", SIZE) as renderer:
        renderer.start()
        pid = renderer.pid
        assert pid is not None
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


@pytest.mark.gl
@pytest.mark.slow
def test_renderer_process_dies_with_its_owner():
    """The owner is killed, so it can tidy nothing; its drawing process sees the pipe close."""
    code = (
        "import sys, numpy as np\n"
        "from realizer.render.renderer import Renderer\n"
        "r = Renderer('default', (32, 32)); r.draw(np.zeros((1, 68)))\n"
        "print(r.pid, flush=True); sys.stdin.read()\n"
    )
    env = {**os.environ, "PYTHONPATH": str(Path(realizer.__path__[0]).parent)}
    owner = subprocess.Popen(
        [sys.executable, "-c", code], stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=env
    )
    assert owner.stdin is not None
    assert owner.stdout is not None
    pid = int(owner.stdout.readline())
    owner.kill()
    owner.wait()
    # The drawing process holds a copy of the owner's stderr only; its end is seen through its own pidfd.
    try:
        handle = os.pidfd_open(pid)
    except ProcessLookupError:
        handle = None
    if handle is not None:
        import select

        ended, _, _ = select.select([handle], [], [], 20)
        os.close(handle)
        assert ended
    owner.stdin.close()
    owner.stdout.close()


@pytest.mark.gl
@pytest.mark.parametrize(
    ("face", "camera", "says"),
    [("default", "top", "camera: wanted one of front"), ("nobody", "front", "nobody")],
)
def test_renderer_explains_what_cannot_be_drawn(face, camera, says):
    with Renderer(face, SIZE, camera) as renderer, pytest.raises(RealizerError, match=says):
        renderer.draw(rows(1))


@pytest.mark.parametrize("shape", [(68,), (2, 67), (1, 2, 68)])
def test_renderer_refuses_wrong_rows_before_it_starts(shape):
    renderer = Renderer("default", SIZE)
    with pytest.raises(ValueError, match=r"poses: wanted \(n, 68\), got"):
        renderer.draw(np.zeros(shape, np.float32))
    assert renderer.pid is None


def test_renderer_refuses_an_empty_size():
    with pytest.raises(ValueError, match=r"size: wanted 1\.\.8192 pixels each way, got 0x10"):
        Renderer("default", (0, 10))


@pytest.mark.gl
@pytest.mark.parametrize("form", ["jpeg", "png", "webp"])
def test_renderer_encodes_every_form(renderer, form):
    (picture,) = renderer.draw(rows(1))
    written = Image.open(io.BytesIO(renderer.encoded(rows(1)[0], form, 95)))
    assert written.format == form.upper()
    assert np.abs(np.asarray(written).astype(int) - picture).mean() < (0.01 if form == "png" else 3)


@pytest.mark.parametrize("way", [pytest.param(way, marks=pytest.mark.gl(way)) for way in ("gl", "onboard")])
@pytest.mark.slow
def test_renderer_draws_transparent_pictures(way):
    black = drawn_here("default", SIZE, rows(2), background="#000000", backend=way).astype(int)
    with Renderer("default", SIZE, background="transparent", backend=way) as renderer:
        clear = renderer.draw(rows(2)).astype(int)
        assert Image.open(io.BytesIO(renderer.encoded(rows(1)[0]))).mode == "RGB"
        for form in ("png", "webp"):
            assert Image.open(io.BytesIO(renderer.encoded(rows(1)[0], form))).mode == "RGBA"
    assert clear.shape == (2, 80, 96, 4)
    assert clear[0, 0, 0, 3] == 0
    assert np.abs(clear[..., :3] * clear[..., 3:] / 255 - black).max() <= 2


@pytest.mark.gl
@pytest.mark.long
@pytest.mark.slow
def test_renderer_draws_another_light(renderer):
    with Renderer("default", SIZE, light="evening") as evening:
        assert evening.draw(rows(1)).mean() < renderer.draw(rows(1)).mean() - 15
