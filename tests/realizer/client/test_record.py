"""Films of live pictures: as long as the block, with picture and sound."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from realizer.client import ClientError, connect
from realizer.client.record import RATE
from realizer.client.record import _film_frames as each
from realizer.client.record import _sound as sound_of
from realizer.protocol.wire import WireFrame, pack, unpack
from tests.realizer.client.service import serving
from tests.waiting import LIMIT

FPS = 5
SIZE = 128
LOOK = '<faceFacs id="f{au}" au="{au}" amount="{amount}" start="0" attackPeak="0.2" relax="2.6" end="2.8"/>'
HELD = f'<bml id="b">{LOOK.format(au=12, amount=1)}{LOOK.format(au=26, amount=0.8)}</bml>'


@pytest.mark.gl
@pytest.mark.slow
def test_record_films_what_is_drawn_without_a_clock(tmp_path: Path) -> None:
    av = pytest.importorskip("av", reason="needs the film extra")
    import realizer
    from tests.pictures import drawn_here

    film = tmp_path / "live.mp4"

    async def test(url: str) -> None:
        async with connect(url) as client:
            end = await client.film(film, HELD, fps=FPS, size=[SIZE, SIZE])
            assert end.id == "b:end"

    serving(test, LIMIT, idle=False)
    played = realizer.realize(HELD, fps=FPS, idle=False)
    still, calm = drawn_here("default", (SIZE, SIZE), played.poses[[8, 0]])
    with av.open(str(film)) as container:
        assert [stream.type for stream in container.streams] == ["video", "audio"]
        pictures = [f.to_ndarray(format="rgb24").astype(int) for f in container.decode(video=0)]
    with av.open(str(film)) as container:
        heard = sum(part.samples / part.sample_rate for part in container.decode(audio=0))
    assert len(pictures) == 15
    assert heard == pytest.approx(len(pictures) / FPS, abs=0.1)
    off = np.abs(pictures[8] - still).mean()
    # As near as the two encoders leave it, and nowhere near the resting face.
    assert off < 4
    assert np.abs(pictures[8] - calm).mean() > off + 0.5


def test_record_refuses_a_suffix_that_is_no_film(tmp_path: Path) -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            with pytest.raises(ClientError, match=r"wanted a film \(.mp4 or .webm\), got live.gif"):
                await client.film(tmp_path / "live.gif", HELD)

    serving(test, LIMIT, idle=False)


def test_record_names_a_missing_folder_before_it_plays(tmp_path: Path) -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            with pytest.raises(FileNotFoundError, match="nowhere"):
                await client.film(tmp_path / "nowhere" / "x.mp4", '<bml id="b"/>')
            assert not client._router.feedback

    serving(test, LIMIT, idle=False)


def test_record_places_sound_at_its_time_and_removes_what_was_flushed() -> None:
    packets = [
        unpack(pack("audio", k, 1.0 + k * 0.02, np.full(RATE // 50, k + 1, "<i2").tobytes()))
        for k in range(4)
    ]
    packets.append(unpack(pack("audio", 2, 1.04, b"", flush=True)))
    pcm = sound_of(packets, 1.01, 0.1)
    step = RATE // 100
    assert [int(pcm[k * step]) for k in range(5)] == [1, 2, 2, 0, 0]


def test_record_repeats_the_picture_before_a_missing_one() -> None:
    def picture(frame: int, grey: int) -> WireFrame:
        buffer = io.BytesIO()
        Image.new("RGB", (16, 16), (grey,) * 3).save(buffer, "PNG")
        return unpack(pack("video", frame, frame / 10, buffer.getvalue()))

    shown = each([picture(0, 10), picture(1, 20), picture(4, 50)], 0.1, 10, 5)
    assert [int(one[0, 0, 0]) for one in shown] == [20, 20, 20, 50, 50]
