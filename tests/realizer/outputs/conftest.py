"""A small realization made by hand: one nod, two words, a second and a half."""

from __future__ import annotations

import json
import shutil
import subprocess
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bml_schema import BlockProgress
from realizer.animation.axis import AU_NAMES, axis
from realizer.animation.frames import AUFrames, FAPFrames
from realizer.outputs.output import RenderSettings
from realizer.playback.scheduled_speech import ScheduledSpeech
from realizer.realization import Performance, Realization
from realizer.render.renderer import Renderer
from realizer.scheduling.timing import Schedule, Warning
from realizer.speech.utterance import Phoneme, Utterance, Word
from tests.waiting import LIMIT

FPS = 25.0
DURATION = 1.5
RATE = 16000
READERS = Path(__file__).parent / "readers"


@pytest.fixture
def realization() -> Realization:
    times = np.arange(38) / FPS
    columns = axis()
    targets = np.zeros((38, len(columns)), np.float32)
    targets[:, AU_NAMES().index("12L")] = np.linspace(0, 1, 38)
    values = np.zeros((38, 68), np.float32)
    values[:, 2] = 400 * np.sin(times * 4) ** 2
    values[:, 47] = -5000.4 * np.sin(times)
    mask = np.zeros(68, bool)
    mask[[2, 3, 47]] = True
    points = ("start", "stroke", "end")
    nod = Schedule("greeting", {"nod": points}, {"nod": np.array([0.0, 0.61, 1.2])}, start=0.2)
    tone = (9000 * np.sin(2 * np.pi * 440 * np.arange(RATE) / RATE)).astype(np.int16)
    hello = Utterance(
        1.0,
        (Word(0.0, 0.4, "Hello"), Word(0.4, 0.9, "R&D <team>")),
        (Phoneme(0.0, 0.1, "h"), Phoneme(0.1, 0.4, "oʊ", 1), Phoneme(0.4, 0.5, ""), Phoneme(0.5, 0.9, "iː")),
        {},
        sample_rate=RATE,
        pcm=tone,
    )
    return Realization(
        fps=FPS,
        duration=DURATION,
        face_name="default",
        characters={None: Performance(AUFrames(times, targets), FAPFrames(times, values, mask))},
        schedules=(nod,),
        feedback_events=(BlockProgress(id="greeting:start", global_time=0.2),),
        warnings=(Warning("greeting:wave", "IMPOSSIBLE_TO_SCHEDULE", "too short"),),
        speeches=(ScheduledSpeech(0.25, 1.25, hello, 0),),
    )


class OpenRenderer(Renderer):
    """A renderer that stays open between outputs: it takes longer to start than to draw them."""

    def __exit__(self, *_: object) -> None:
        return


@pytest.fixture(scope="session")
def rendering() -> Iterator[Callable[..., RenderSettings]]:
    """Settings with an open renderer of a size, the same one for the same `copy`."""
    with ExitStack() as stack:

        @cache
        def settings(size: tuple[int, int], copy: int = 0) -> RenderSettings:
            renderer = OpenRenderer("default", size)
            stack.callback(renderer.close)
            return RenderSettings(size, renderer=renderer)

        yield settings


@pytest.fixture(scope="session")
def turn() -> str:
    """A document of which every part of a head has something: lips, brows, lids, eyes, neck."""
    return (
        '<bml id="a" xmlns="http://www.bml-initiative.org/bml/bml-1.0">'
        '<speech id="s" start="0"><text>Oh, what a beautiful morning</text></speech>'
        '<faceLexeme id="f" lexeme="HAPPINESS" start="0" end="2"/>'
        '<head id="h" lexeme="SHAKE" start="0.2"/><gaze id="g" target="10,5,30" start="0"/></bml>'
    )


@pytest.fixture(scope="session")
def read_by() -> Callable[..., Any]:
    """Return a function that reads a file by a foreign program in `readers/` and returns its JSON."""
    node = shutil.which("node")

    def read(script: str, *arguments: str | Path) -> Any:
        if node is None or not (READERS / "node_modules").is_dir():
            pytest.skip(f"needs Node and: npm ci --prefix {READERS}")
        done = subprocess.run(
            [node, READERS / script, *map(str, arguments)], capture_output=True, text=True, timeout=LIMIT
        )
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return read
