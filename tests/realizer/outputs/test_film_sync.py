"""Films, decoded: the mouth opens when it is heard."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from realizer.offline import realize
from realizer.outputs.film import RATE, write_film
from realizer.outputs.output import RenderSettings

av = pytest.importorskip("av", reason="films need PyAV: pip install 'bml-realizer[film]'")

# A closed mouth until the burst of a /p/, and again one after a pause.
SAID = '<bml id="b"><speech id="s" start="0.5"><text>Papa.</text></speech></bml>'
OPENING = [3, 4]  # columns of FAP 4 and 5, the inner lips
SIZE = 128
FPS = 50.0


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
    played = realize(SAID, fps=FPS, idle=False, prosody=False, voice="espeak")
    path = tmp_path / f"x{suffix}"
    write_film(played, path, RenderSettings((SIZE, SIZE), "close"))
    pictures, times, line = decoded(path)
    assert times == pytest.approx([k / FPS for k in range(len(pictures))], abs=0.002)

    asked = onset(played.sound(RATE).astype(float))
    assert 0.5 <= asked < 0.7
    assert onset(line) == pytest.approx(asked, abs=0.02), "the encoder's delay is made up for"

    # The difference of each picture from the neutral face grows with the opening of the mouth.
    opening = np.abs(played.faps.values[:, OPENING]).sum(1)
    changed = np.abs(pictures - pictures[0]).mean((1, 2))
    assert changed[: round(0.4 * FPS)].max() < 0.05 * changed.max(), "it does not move before"
    shifts = range(-4, 5)
    alike = [np.corrcoef(changed[8:-8], opening[8 + s : len(opening) - 8 + s])[0, 1] for s in shifts]
    assert shifts[int(np.argmax(alike))] == 0, "no picture early or late"
