"""Tests of the reader of sound files."""

from __future__ import annotations

import io

import numpy as np
import pytest

from realizer.behaviours.sound_file import read_sound
from realizer.core.errors import RealizerError

av = pytest.importorskip("av", reason="pip install 'bml-realizer[film]'")


def encoded(kind: str, codec: str, rate: int = 48_000) -> bytes:
    """Return half a second of a tone as a file."""
    tone = (0.5 * 32767 * np.sin(2 * np.pi * 440 * np.arange(rate // 2) / rate)).astype(np.int16)
    file = io.BytesIO()
    with av.open(file, "w", format=kind) as out:
        stream = out.add_stream(codec, rate=rate, layout="mono")
        frame = av.AudioFrame.from_ndarray(tone[None], format="s16", layout="mono")
        frame.rate = rate
        out.mux([*stream.encode(frame), *stream.encode(None)])
    return file.getvalue()


@pytest.mark.parametrize(
    ("kind", "codec"), [("flac", "flac"), ("ogg", "libopus"), ("mp3", "libmp3lame"), ("webm", "libopus")]
)
def test_read_sound_reads_every_format(kind, codec) -> None:
    recording = read_sound(encoded(kind, codec))
    assert recording.rate == 48_000
    assert len(recording.pcm) == pytest.approx(24_000, abs=2500)
    assert np.abs(np.fft.rfft(recording.pcm, 48_000)).argmax() == pytest.approx(440, abs=2)
    assert np.abs(recording.pcm.astype(int)).max() == pytest.approx(0.5 * 32767, rel=0.1)


@pytest.mark.parametrize(
    "content", [b"ID3 is no music", b"OggS" + b"\0" * 40, b"fLaC", b"RIFF", b"", b"#EXTM3U\nx"]
)
def test_read_sound_refuses_other_files(content) -> None:
    with pytest.raises(RealizerError, match="wanted"):
        read_sound(content)
