"""A film of what was drawn live: as long as its block, with its picture and its sound."""

from __future__ import annotations

import asyncio
from pathlib import Path

import numpy as np
import pytest

from realizer.client import ClientError, connect
from realizer.server.serve import Server
from realizer.settings import Settings

LIMIT = 120  # s
FPS = 5
SIZE = 128
LOOK = '<faceFacs id="f{au}" au="{au}" amount="{amount}" start="0" attackPeak="0.2" relax="2.6" end="2.8"/>'
HELD = f'<bml id="b">{LOOK.format(au=12, amount=1)}{LOOK.format(au=26, amount=0.8)}</bml>'


def serving(test) -> None:
    async def run() -> None:
        settings = Settings(port=0, voice="silent", idle=False)
        async with asyncio.timeout(LIMIT), Server(settings) as server:
            await test(server.url)

    asyncio.run(run())


@pytest.mark.gl
def test_the_film_of_a_block_shows_what_is_drawn_without_a_clock(tmp_path: Path) -> None:
    av = pytest.importorskip("av", reason="needs the film extra")
    import realizer
    from realizer.render import Renderer

    film = tmp_path / "live.mp4"

    async def test(url: str) -> None:
        async with connect(url) as client:
            end = await client.film(film, HELD, fps=FPS, size=[SIZE, SIZE])
            assert end.id == "b:end"

    serving(test)
    played = realizer.realize(HELD, fps=FPS, idle=False)
    with Renderer("default", (SIZE, SIZE)) as renderer:
        (still,) = renderer.draw(played.poses[8:9])
        (calm,) = renderer.draw(played.poses[:1])
    with av.open(str(film)) as container:
        assert [stream.type for stream in container.streams] == ["video", "audio"]
        pictures = [f.to_ndarray(format="rgb24").astype(int) for f in container.decode(video=0)]
    assert len(pictures) in (15, 16)
    off = np.abs(pictures[8] - still).mean()
    # As near as the two encoders leave it, and nowhere near the resting face.
    assert off < 4
    assert np.abs(pictures[8] - calm).mean() > off + 0.5


def test_a_suffix_that_is_no_film_is_refused(tmp_path: Path) -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            with pytest.raises(ClientError, match=r"wanted a film \(.mp4 or .webm\), got live.gif"):
                await client.film(tmp_path / "live.gif", HELD)

    serving(test)
