"""Films, read back."""

from __future__ import annotations

import logging
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from realizer.offline import realize
from realizer.outputs.film import FORMATS, RATE, encode_film, write_film
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS
from realizer.outputs.speech_spans import Span

av = pytest.importorskip("av", reason="films need PyAV: pip install 'bml-realizer[film]'")

COUNT, FPS = 30, 25.0


def pictures(count=COUNT, size=(120, 160)):
    """A bright square that walks to the right over a coloured slope."""
    y, x = np.mgrid[0 : size[0], 0 : size[1]]
    for k in range(count):
        picture = np.stack([x, 40 + y // 2, np.full_like(x, 90)], -1).astype(np.uint8)
        picture[40:80, 4 * k : 4 * k + 30] = (220, 180, 150)
        yield picture


def beep(at: float, length: float = 0.2, total: float = COUNT / FPS):
    t = np.arange(round(total * RATE)) / RATE
    return (12000 * np.sin(2 * np.pi * 1000 * t) * ((t >= at) & (t < at + length))).astype(np.int16)


def film_of(path, suffix, sound, fps=FPS, **kwargs):
    encode_film(path, FORMATS[suffix], pictures(**kwargs), kwargs.get("count", COUNT), fps, sound)
    return path


def seen(path):
    with av.open(str(path)) as film:
        return [(float(f.time), f.to_ndarray(format="rgb24")) for f in film.decode(video=0)]


def heard(path):
    """(n,) float from time 0 at RATE, placed by the packets' times."""
    with av.open(str(path)) as film:
        line = np.zeros(4 * RATE)
        for frame in film.decode(audio=0):
            pcm = frame.to_ndarray()[0].astype(float)
            pcm = pcm / 32768 if frame.format.name.startswith("s16") else pcm
            first = round(float(frame.time) * RATE)
            if first < 0:
                pcm, first = pcm[-first:], 0
            line[first : first + len(pcm)] = pcm
        return line


@pytest.mark.parametrize("suffix", FORMATS)
def test_film_has_every_picture_at_its_time(tmp_path, suffix):
    shown = seen(film_of(tmp_path / f"x{suffix}", suffix, beep(0.5)))
    assert len(shown) == COUNT
    assert [t for t, _ in shown] == pytest.approx([k / FPS for k in range(COUNT)], abs=0.002)
    for (_, got), wanted in zip(shown, pictures(), strict=True):
        assert np.abs(got.astype(int) - wanted).mean() < 6


@pytest.mark.parametrize("suffix", FORMATS)
def test_film_sound_is_synchronous(tmp_path, suffix):
    line = heard(film_of(tmp_path / f"x{suffix}", suffix, beep(0.5)))
    loud = np.flatnonzero(np.abs(line) > 0.1)
    assert loud[0] / RATE == pytest.approx(0.5, abs=0.01)
    assert loud[-1] / RATE == pytest.approx(0.7, abs=0.02)


@pytest.mark.parametrize("suffix", FORMATS)
def test_film_without_speech_has_a_silent_track(tmp_path, suffix):
    path = film_of(tmp_path / f"x{suffix}", suffix, np.zeros(0, np.int16))
    with av.open(str(path)) as film:
        (track,) = film.streams.audio
        assert track.rate == RATE
        assert film.duration / 1e6 == pytest.approx(COUNT / FPS, abs=0.03)
        last = max(float(f.time) + f.samples / f.sample_rate for f in film.decode(audio=0))
    assert last >= COUNT / FPS - 0.002
    assert np.abs(heard(path)).max() < 1e-3


@pytest.mark.parametrize("suffix", FORMATS)
def test_film_is_deterministic(tmp_path, suffix):
    films = {film_of(tmp_path / f"{k}{suffix}", suffix, beep(0.3)).read_bytes() for k in range(4)}
    assert len(films) == 1


@pytest.mark.parametrize("suffix", FORMATS)
def test_film_of_odd_size_loses_a_row(tmp_path, suffix):
    shown = seen(film_of(tmp_path / f"x{suffix}", suffix, beep(0.3), count=3, size=(121, 161)))
    assert shown[0][1].shape == (120, 160, 3)


@pytest.mark.parametrize("fps", [10.0, 29.97, 50.0])
def test_film_of_other_rates_keeps_time(tmp_path, fps):
    shown = seen(film_of(tmp_path / "x.mp4", ".mp4", beep(0.3), fps=fps))
    assert shown[-1][0] == pytest.approx((COUNT - 1) / fps, abs=0.002)


def test_film_in_mp4_starts_with_its_index(tmp_path):
    content = film_of(tmp_path / "x.mp4", ".mp4", beep(0.3)).read_bytes()
    assert 0 < content.index(b"moov") < content.index(b"mdat")


def test_film_colours_are_tagged_bt709(tmp_path):
    with av.open(str(film_of(tmp_path / "x.mp4", ".mp4", beep(0.3)))) as film:
        context = film.streams.video[0].codec_context
        assert (context.colorspace, context.color_primaries, context.color_trc) == (1, 1, 1)


def test_film_reports_its_progress(tmp_path, caplog):
    with caplog.at_level(logging.INFO, "realizer.outputs.film"):
        film_of(tmp_path / "x.mp4", ".mp4", beep(0.3), count=260, size=(16, 16))
    assert [r.message for r in caplog.records] == ["film: 250 of 260 pictures"]


def test_film_without_pyav_says_what_to_install(tmp_path):
    code = (
        "import sys; sys.modules['av'] = None\n"
        "import numpy as np\n"
        "from realizer.core.errors import RealizerError\n"
        "from realizer.outputs.film import FORMATS, encode_film\n"
        "try: encode_film('x.mp4', FORMATS['.mp4'], [], 0, 25.0, np.zeros(0, np.int16))\n"
        "except RealizerError as error: print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path
    )
    assert done.stdout == "films need PyAV: pip install 'bml-realizer[film]'\n"
    assert not list(tmp_path.iterdir())


@pytest.mark.gl
@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.slow
def test_film_of_a_realization_shows_its_face(realization, tmp_path, rendering, suffix):
    path = tmp_path / f"x{suffix}"
    OUTPUTS[suffix].write(realization, path, replace(rendering((130, 128)), size=(129, 128)))
    shown = seen(path)
    assert len(shown) == 38
    assert shown[0][1].shape == (128, 130, 3)
    assert shown[0][1].std() > 20
    assert np.abs(shown[0][1].astype(int) - shown[10][1]).max() > 20
    assert np.abs(heard(path)[int(0.4 * RATE) : RATE]).max() > 0.1
    assert subtitles(path) == [(0.25, 1.52, "Hello R&D <team>")]


def subtitles(path):
    """(start, end, text) of a film's subtitles, in seconds."""
    with av.open(str(path)) as film:
        (track,) = film.streams.subtitles
        found = []
        for packet in film.demux(track):
            if not packet.duration:
                continue
            text = "\n".join(rect.dialogue.decode() for rect in packet.decode())
            start, length = (float(t * packet.time_base) for t in (packet.pts, packet.duration))
            # FFmpeg reports line ends as in ASS.
            found.append((round(start, 3), round(start + length, 3), text.replace("\\N", "\n").strip()))
        return [line for line in found if line[2]]


LINES = (Span(0.2, 0.6, "Grüß Gott"), Span(0.6, 0.7, "a & <b>"), Span(0.9, 1.2, "ann\nbob"))


@pytest.mark.parametrize("suffix", FORMATS)
def test_film_has_subtitles(tmp_path, suffix):
    path = tmp_path / f"x{suffix}"
    encode_film(path, FORMATS[suffix], pictures(), COUNT, FPS, beep(0.5), lines=LINES)
    assert subtitles(path) == [(line.start, line.end, line.text) for line in LINES]
    assert len(seen(path)) == COUNT


@pytest.mark.parametrize("suffix", FORMATS)
def test_film_is_not_longer_with_subtitles(tmp_path, suffix):
    path = tmp_path / f"x{suffix}"
    late = Span(1.0, 9.0, "and so on")
    encode_film(path, FORMATS[suffix], pictures(), COUNT, FPS, beep(0.5), lines=[late])
    assert subtitles(path) == [(1.0, COUNT / FPS, "and so on")]


@pytest.mark.parametrize("suffix", FORMATS)
def test_film_with_subtitles_is_deterministic(tmp_path, suffix):
    for k in range(2):
        encode_film(tmp_path / f"{k}{suffix}", FORMATS[suffix], pictures(), COUNT, FPS, beep(0), lines=LINES)
    assert (tmp_path / f"0{suffix}").read_bytes() == (tmp_path / f"1{suffix}").read_bytes()


def test_film_without_speech_has_no_subtitles(tmp_path):
    with av.open(str(film_of(tmp_path / "x.mp4", ".mp4", beep(0.3)))) as film:
        assert len(film.streams) == 2


# A closed mouth until the burst of a /p/, and again one after a pause.
SAID = '<bml id="b"><speech id="s" start="0.5"><text>Papa.</text></speech></bml>'
OPENING = [3, 4]  # columns of FAP 4 and 5, the inner lips
SIZE = 128
SPOKEN_FPS = 50.0


def onset(line: np.ndarray, after: float = 0.0) -> float:
    """When the sound first rises above a hundredth of its peak."""
    first = round(after * RATE)
    return (first + np.flatnonzero(np.abs(line[first:]) > 0.01 * np.abs(line).max())[0]) / RATE


def decoded(path: Path) -> tuple[np.ndarray, list[float], np.ndarray]:
    """Pictures, their times, and the sound by the times that a player goes by."""
    with av.open(str(path)) as film:
        shown = [(float(f.time), f.to_ndarray(format="gray").astype(float)) for f in film.decode(video=0)]
    with av.open(str(path)) as film:
        line = np.zeros(round((shown[-1][0] + 2) * RATE))
        for frame in film.decode(audio=0):
            pcm, first = frame.to_ndarray()[0].astype(float), round(float(frame.time) * RATE)
            pcm, first = pcm[max(0, -first) :], max(0, first)
            line[first : first + len(pcm)] = pcm
    return np.stack([picture for _, picture in shown]), [time for time, _ in shown], line


@pytest.mark.gl
@pytest.mark.espeak
@pytest.mark.parametrize("suffix", [".mp4", pytest.param(".webm", marks=pytest.mark.slow)])
def test_film_mouth_opens_when_it_is_heard(tmp_path: Path, suffix: str) -> None:
    played = realize(SAID, fps=SPOKEN_FPS, idle=False, prosody=False, voice="espeak")
    path = tmp_path / f"x{suffix}"
    write_film(played, path, RenderSettings((SIZE, SIZE), "close"))
    pictures, times, line = decoded(path)
    assert times == pytest.approx([k / SPOKEN_FPS for k in range(len(pictures))], abs=0.002)

    asked = onset(played.sound(RATE).astype(float))
    assert 0.5 <= asked < 0.7
    assert onset(line) == pytest.approx(asked, abs=0.02), "the encoder's delay is made up for"

    # The difference of each picture from the neutral face grows with the opening of the mouth.
    opening = np.abs(played.faps.values[:, OPENING]).sum(1)
    changed = np.abs(pictures - pictures[0]).mean((1, 2))
    assert changed[: round(0.4 * SPOKEN_FPS)].max() < 0.05 * changed.max(), "it does not move before"
    shifts = range(-4, 5)
    alike = [np.corrcoef(changed[8:-8], opening[8 + s : len(opening) - 8 + s])[0, 1] for s in shifts]
    assert shifts[int(np.argmax(alike))] == 0, "no picture early or late"
