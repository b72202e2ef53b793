"""A film and a stream of the same document show the same pictures."""

from __future__ import annotations

import io

import numpy as np
import pytest
from PIL import Image

from realizer.offline import realize
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS
from realizer.server.runtime.engines import Engines
from realizer.server.session.effects import Draw, Speak
from tests.pictures import drawn_here
from tests.realizer.server.conftest import Driver

pytestmark = pytest.mark.xdist_group("outputs")

av = pytest.importorskip("av", reason="films need PyAV: pip install 'bml-realizer[film]'")

FPS, SIZE = 12.5, (160, 160)
LOSS = 4  # of 255, on average: what H.264 loses


class Screening(Driver):
    """A session whose voice and pictures are ready at once."""

    def __init__(self) -> None:
        self.studio = Engines()
        super().__init__(idle=False, voice="silent")

    def do(self, effect) -> None:
        match effect:
            case Speak(id):
                self.session.on_speech(id, self.studio.speak(effect), self.opened + self.now)
                self.collect()
            case Draw(id):
                self.session.on_picture(id, self.studio.draw(effect), self.opened + self.now)
                self.collect()
            case _:
                super().do(effect)


@pytest.fixture(scope="module")
def streamed(turn) -> dict[int, np.ndarray]:
    """Frame number -> its picture, as a viewer of the session gets them, without loss."""
    screening = Screening()
    look = {"stream": "video", "format": "png", "size": list(SIZE), "fps": FPS}
    screening.send({"type": "subscribe", **look})
    screening.send(turn)
    client = screening.run(2.5)
    screening.studio.close()
    assert client.ids[-1] == "a:end"
    return {f.frame: np.asarray(Image.open(io.BytesIO(f.payload)).convert("RGB")) for f in client.frames}


@pytest.fixture(scope="module")
def played(turn):
    return realize(turn, idle=False, voice="silent", fps=FPS)


@pytest.mark.gl
@pytest.mark.slow
def test_pictures_of_film_and_stream_are_equal(streamed, played):
    drawn = drawn_here(played.face_name, SIZE, played.poses)
    assert set(range(len(drawn))) <= set(streamed)
    assert np.abs(drawn[0].astype(int) - drawn[8]).max() > 60
    for k, picture in enumerate(drawn):
        assert np.array_equal(picture, streamed[k]), f"frame {k}"


@pytest.mark.gl
@pytest.mark.slow
def test_film_shows_the_pictures_of_the_stream(streamed, played, tmp_path):
    path = tmp_path / "x.mp4"
    OUTPUTS[".mp4"].write(played, path, RenderSettings(SIZE))
    with av.open(str(path)) as film:
        filmed = [frame.to_ndarray(format="rgb24").astype(int) for frame in film.decode(video=0)]
    assert len(filmed) == played.frames
    for k, picture in enumerate(filmed):
        assert np.abs(picture - streamed[k]).mean() < LOSS, f"frame {k}"
    # It is this frame that is shown, and none of those about it.
    moving = [
        k for k in range(1, len(filmed)) if np.abs(streamed[k].astype(int) - streamed[k - 1]).mean() > 1
    ]
    assert len(moving) > 3
    for k in moving:
        near = [np.abs(filmed[k] - streamed[j]).mean() for j in (k - 1, k)]
        assert near[1] < near[0]
