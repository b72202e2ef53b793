"""Tests of the reader of sound files."""

import io
import struct
import wave

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.behaviours.sound_file import read_sound, read_wav
from realizer.core.errors import RealizerError
from tests.realizer.behaviours.conftest import tone, wav

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


TONE = tone(0.1)


def coded(bits: int, coding: int = 1, values: np.ndarray = TONE) -> bytes:
    if coding == 3:
        return values.astype("<f4").tobytes()
    if bits == 8:
        return (np.rint(values * 127) + 128).astype(np.uint8).tobytes()
    whole = np.rint(values * (2 ** (bits - 1) - 1)).astype("<i4")
    if bits == 24:
        return whole.view(np.uint8).reshape(-1, 4)[:, :3].tobytes()
    return whole.astype(f"<i{bits // 8}").tobytes()


@pytest.mark.parametrize(
    ("bits", "coding", "within"), [(8, 1, 260), (16, 1, 1), (24, 1, 1), (32, 1, 1), (32, 3, 1)]
)
def test_read_wav_gives_the_same_sound_for_every_coding(bits: int, coding: int, within: int) -> None:
    rate, pcm = read_wav(wav(coded(bits, coding), bits=bits, coding=coding))
    assert rate == 8000
    assert pcm.dtype == np.int16
    np.testing.assert_allclose(pcm, TONE * 32767, atol=within)


def test_read_wav_mixes_channels() -> None:
    both = np.stack([TONE, np.zeros_like(TONE)], axis=1).ravel()
    rate, pcm = read_wav(wav(coded(16, values=both), channels=2, rate=44100))
    assert rate == 44100
    np.testing.assert_allclose(pcm, TONE * 32767 / 2, atol=1)


def test_read_wav_reads_files_of_the_standard_library() -> None:
    file = io.BytesIO()
    with wave.open(file, "wb") as out:
        out.setparams((1, 3, 22050, 0, "NONE", ""))
        out.writeframes(coded(24))
    rate, pcm = read_wav(file.getvalue())
    assert (rate, len(pcm)) == (22050, len(TONE))


def test_read_wav_reads_the_extensible_header() -> None:
    form = struct.pack("<HHIIHH", 0xFFFE, 1, 8000, 24000, 3, 24) + struct.pack("<HHI", 22, 24, 4)
    form += struct.pack("<H", 1) + bytes.fromhex("000000001000800000aa00389b71")
    data = coded(24)
    chunks = b"fmt " + struct.pack("<I", len(form)) + form + b"LIST\3\0\0\0abc\0"
    chunks += b"data" + struct.pack("<I", len(data)) + data
    _, pcm = read_wav(b"RIFF" + struct.pack("<I", 4 + len(chunks)) + b"WAVE" + chunks)
    np.testing.assert_allclose(pcm, TONE * 32767, atol=1)


def test_read_wav_of_a_cut_file_gives_what_is_left() -> None:
    _, pcm = read_wav(wav(coded(16))[:-101])
    assert len(pcm) == len(TONE) - 51


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"", "wanted a WAV, FLAC, Ogg, MP3 or WebM file, got an empty one"),
        (
            b"no sound at all",
            "wanted a WAV, FLAC, Ogg, MP3 or WebM file, got one that begins with b'no sound'",
        ),
        (b"OggS and more", "got one that begins with b'OggS and'"),
        (b"RIFF\0\0\0\0WAVE", "with a format and data"),
        (wav(b""), "without samples"),
        (wav(b"12345678", coding=2, bits=4), "got coding 2 of 4 bits"),
        (wav(b"12345678", rate=10), "at 10 Hz"),
        (wav(b"12345678", channels=0), "got 0"),
    ],
)
def test_read_wav_refuses_other_files(content: bytes, says: str) -> None:
    with pytest.raises(RealizerError, match=says):
        read_wav(content)


@given(st.data())
def test_read_wav_of_damaged_files_reads_or_refuses(data: st.DataObject) -> None:
    content = bytearray(wav(coded(16)[:40]))
    for _ in range(data.draw(st.integers(1, 6))):
        content[data.draw(st.integers(0, len(content) - 1))] = data.draw(st.integers(0, 255))
    try:
        _, pcm = read_wav(bytes(content[: data.draw(st.integers(0, len(content)))]))
    except RealizerError:
        return
    assert pcm.dtype == np.int16
    assert len(pcm)
