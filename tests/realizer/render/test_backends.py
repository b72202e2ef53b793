"""Tests of the selection of a backend."""

from __future__ import annotations

import pytest

from realizer.core.errors import RenderError
from realizer.render import backends
from realizer.render.cameras import camera_for
from realizer.render.light import preset


def test_open_canvas_prefers_a_graphics_card(tmp_path):
    assert backends._order(tmp_path) == ("onboard", "gl")
    (tmp_path / "dri").mkdir()
    (tmp_path / "dri" / "renderD128").touch()
    assert backends._order(tmp_path) == ("gl", "onboard")


@pytest.mark.gl("onboard")
@pytest.mark.parametrize("way", ["auto", "onboard"])
def test_open_canvas_returns_the_backend_s_name(balls, way):
    face, normals = balls
    taken, canvas = backends.open_canvas(face, (32, 24), camera_for(face), preset(), backend=way)
    assert taken in ("gl", "onboard")
    assert way in ("auto", taken)
    assert canvas.draw(face.vertices, normals).shape == (24, 32, 3)
    canvas.close()


def test_open_canvas_lists_the_known_backends(balls):
    face, _ = balls
    with pytest.raises(RenderError, match="wanted one of auto, gl, onboard, got 'vulkan'"):
        backends.open_canvas(face, (32, 24), camera_for(face), preset(), backend="vulkan")


def test_open_canvas_names_both_backends_if_none_works(balls, monkeypatch):
    face, _ = balls

    def missing(*_):
        raise RenderError("not here")

    monkeypatch.setattr(backends, "_canvas", lambda _: missing)
    with pytest.raises(RenderError, match="not here; or: not here"):
        backends.open_canvas(face, (32, 24), camera_for(face), preset())
