"""The engines: as many kinds of pictures at a time as there is room for, and the others notice nothing."""

from __future__ import annotations

import io
import threading
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pytest
from PIL import Image

from realizer.core.errors import RenderError
from realizer.server.runtime.engines import IDLE, Engines
from realizer.server.session.effects import Draw, RenderOptions
from tests.waiting import LIMIT


@dataclass
class Clock:
    now: float = 0.0
    asked: threading.Event | None = None  # is set by each request

    def __call__(self) -> float:
        now = self.now
        if self.asked is not None:
            self.asked.set()
        return now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def engines(clock) -> Iterator[Engines]:
    engines = Engines(clock=clock)
    yield engines
    engines.close()


def order(width: int, form: str = "jpeg") -> Draw:
    look = RenderOptions((width, 16), "front", None, "#102030", 80, form)
    return Draw(1, "default", np.zeros(68, np.float32), look)


def width(picture: bytes) -> int:
    return Image.open(io.BytesIO(picture)).width


@pytest.mark.gl
@pytest.mark.slow
def test_engines_refuse_one_picture_too_many_and_draw_the_others(
    engines, clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("realizer.server.runtime.engines.RENDERERS", 2)
    for k in range(2):
        clock.now = 0.1 * k
        assert width(engines.draw(order(16 + k))) == 16 + k
    refused = engines.draw(order(99))
    assert isinstance(refused, RenderError)
    assert "different pictures" in str(refused)
    clock.now = 1.0
    for form in ("jpeg", "png", "webp"):
        picture = engines.draw(order(17, form))
        assert Image.open(io.BytesIO(picture)).format == form.upper()
        assert width(picture) == 17
    # The first one is idle, and makes room.
    clock.now = IDLE + 0.5
    assert width(engines.draw(order(99))) == 99
    assert isinstance(engines.draw(order(16)), RenderError)


@pytest.mark.gl
@pytest.mark.long
@pytest.mark.slow
def test_engines_keep_a_renderer_that_takes_long_to_start(
    engines, clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("realizer.server.runtime.engines.RENDERERS", 2)
    assert width(engines.draw(order(16))) == 16
    begins = clock.asked = threading.Event()
    starting = engines.render_pool.submit(0, lambda: engines.draw(order(17)))
    assert begins.wait(LIMIT)
    clock.now = IDLE + 1.0
    clock.asked = None
    assert width(starting.result(LIMIT)) == 17
    # The first one has waited for the second to start, for longer than an idle one may.
    assert isinstance(engines.draw(order(99)), RenderError)
    assert width(engines.draw(order(16))) == 16


@pytest.mark.gl
def test_engines_keep_a_renderer_that_draws(engines, clock, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("realizer.server.runtime.engines.RENDERERS", 1)
    begins = clock.asked = threading.Event()
    drawing = engines.render_pool.submit(0, lambda: engines.draw(order(16)))
    assert begins.wait(LIMIT)
    clock.asked = None
    clock.now = 2 * IDLE
    assert isinstance(engines.draw(order(99)), RenderError)
    assert width(drawing.result(LIMIT)) == 16


@pytest.mark.gl
def test_engines_return_the_error_of_an_unknown_face(engines) -> None:
    look = RenderOptions((16, 16), "front", None, None, 80)
    answer = engines.draw(Draw(1, "nobody", np.zeros(68, np.float32), look))
    assert "nobody" in str(answer)
