"""Which way is taken: by what the machine has."""

from __future__ import annotations

import pytest

from realizer.core.errors import RenderError
from realizer.render import backends
from realizer.render.cameras import camera_for
from realizer.render.light import preset


def test_a_graphics_card_is_used_first_and_without_one_the_processor(tmp_path):
    assert backends._order(tmp_path) == ("onboard", "gl")
    (tmp_path / "dri").mkdir()
    (tmp_path / "dri" / "renderD128").touch()
    assert backends._order(tmp_path) == ("gl", "onboard")


@pytest.mark.gl("onboard")
@pytest.mark.parametrize("way", ["auto", "onboard"])
def test_a_canvas_comes_with_the_way_that_was_taken(balls, way):
    face, normals = balls
    taken, canvas = backends.open_canvas(face, (32, 24), camera_for(face), preset(), backend=way)
    assert taken in ("gl", "onboard")
    assert way in ("auto", taken)
    assert canvas.draw(face.vertices, normals).shape == (24, 32, 3)
    canvas.close()


def test_another_way_is_refused_with_the_known_ones(balls):
    face, _ = balls
    with pytest.raises(RenderError, match="wanted one of auto, gl, onboard, got 'vulkan'"):
        backends.open_canvas(face, (32, 24), camera_for(face), preset(), backend="vulkan")


def test_where_no_way_is_there_the_sentence_names_both(balls, monkeypatch):
    face, _ = balls

    def missing(*_):
        raise RenderError("not here")

    monkeypatch.setattr(backends, "OPENERS", {"gl": missing, "onboard": missing})
    with pytest.raises(RenderError, match="not here; or: not here"):
        backends.open_canvas(face, (32, 24), camera_for(face), preset())
