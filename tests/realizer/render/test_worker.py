"""Tests of the drawing process from inside."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import realizer
from realizer.core.errors import RenderError
from realizer.render import worker
from realizer.render.cameras import camera_for
from realizer.render.light import preset


def test_open_canvas_prefers_a_graphics_card(tmp_path):
    assert worker._order(tmp_path) == ("onboard", "gl")
    (tmp_path / "dri").mkdir()
    (tmp_path / "dri" / "renderD128").touch()
    assert worker._order(tmp_path) == ("gl", "onboard")


@pytest.mark.gl("onboard")
@pytest.mark.parametrize("way", ["auto", "onboard"])
def test_open_canvas_returns_the_backend_s_name(balls, way):
    face, normals = balls
    taken, canvas = worker.open_canvas(face, (32, 24), camera_for(face), preset(), backend=way)
    assert taken in ("gl", "onboard")
    assert way in ("auto", taken)
    assert canvas.draw(face.vertices, normals).shape == (24, 32, 3)
    canvas.close()


def test_open_canvas_lists_the_known_backends(balls):
    face, _ = balls
    with pytest.raises(RenderError, match="wanted one of auto, gl, onboard, got 'vulkan'"):
        worker.open_canvas(face, (32, 24), camera_for(face), preset(), backend="vulkan")


def test_open_canvas_names_both_backends_if_none_works(balls, monkeypatch):
    face, _ = balls

    def missing(*_):
        raise RenderError("not here")

    monkeypatch.setattr(worker, "_canvas", lambda _: missing)
    with pytest.raises(RenderError, match="not here; or: not here"):
        worker.open_canvas(face, (32, 24), camera_for(face), preset())


def check(tmp_path: Path, site: str, way: str = "auto", **env: str) -> subprocess.CompletedProcess[str]:
    """`unavailable_reason()`'s question, asked on a machine that lacks something."""
    (tmp_path / "sitecustomize.py").write_text(site)
    paths = os.pathsep.join([str(tmp_path), str(Path(realizer.__path__[0]).parent)])
    return subprocess.run(
        [sys.executable, "-P", "-m", "realizer.render.worker", "--check", way],
        env={**os.environ, "PYTHONPATH": paths, **env},
        capture_output=True,
        text=True,
        check=False,
    )


def test_worker_names_the_extra_without_any_backend(tmp_path):
    done = check(tmp_path, "import sys; sys.modules['moderngl'] = sys.modules['numba'] = None")
    assert done.returncode == 3
    assert "pip install 'bml-realizer[render]'" in done.stdout


@pytest.mark.gl("gl")
@pytest.mark.slow
def test_worker_draws_by_opengl_without_numba(tmp_path):
    done = check(tmp_path, "import sys; sys.modules['numba'] = None")
    assert (done.returncode, done.stdout.strip()) == (0, "gl"), done.stderr


@pytest.mark.gl("onboard")
@pytest.mark.slow
def test_worker_draws_by_the_processor_without_moderngl(tmp_path):
    done = check(tmp_path, "import sys; sys.modules['moderngl'] = None")
    assert (done.returncode, done.stdout.strip()) == (0, "onboard"), done.stderr


@pytest.mark.gl("onboard")
@pytest.mark.long
@pytest.mark.slow
def test_worker_compiles_the_loops_without_a_writable_folder(tmp_path):
    """Numba keeps machine code beside the source or in the user's cache, and refuses where neither is."""
    site = "import numba.core.caching as c\nc.CacheImpl._locator_classes = []\n"
    done = check(tmp_path, site, "onboard")
    assert (done.returncode, done.stdout.strip()) == (0, "onboard"), done.stderr


@pytest.mark.gl("gl")
def test_worker_names_the_packages_without_gl(tmp_path):
    """A machine whose loader finds no libEGL."""
    done = check(tmp_path, "", "gl", GLCONTEXT_LINUX_LIBEGL="libmissing.so.1")
    assert done.returncode == 3, done.stderr
    assert "install Debian packages libegl1 and libgl1" in done.stdout


@pytest.mark.gl
def test_encode_writes_jpeg_by_pillow_without_simplejpeg(tmp_path):
    code = (
        "import sys; sys.modules['simplejpeg'] = None\n"
        "import numpy as np\n"
        "from realizer.render.worker import encode\n"
        "sys.stdout.buffer.write(encode(np.full((20, 30, 3), 90, np.uint8)[::-1], 'jpeg', 85))\n"
    )
    env = {**os.environ, "PYTHONPATH": str(Path(realizer.__path__[0]).parent)}
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, check=True, env=env)
    assert np.asarray(Image.open(io.BytesIO(done.stdout))).shape == (20, 30, 3)
