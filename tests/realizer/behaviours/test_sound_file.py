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
from realizer.speech.utterance import Recording
from tests.realizer.behaviours.conftest import tone, wav
from tests.rows import each_row

av = pytest.importorskip("av", reason="pip install 'bml-realizer[film]'")


def encoded(kind: str, codec: str, rate: int = 48_000, tags: dict[str, str] | None = None) -> bytes:
    """Return half a second of a tone as a file."""
    tone = (0.5 * 32767 * np.sin(2 * np.pi * 440 * np.arange(rate // 2) / rate)).astype(np.int16)
    file = io.BytesIO()
    with av.open(file, "w", format=kind) as out:
        out.metadata.update(tags or {})
        stream = out.add_stream(codec, rate=rate, layout="mono")
        frame = av.AudioFrame.from_ndarray(tone[None], format="s16", layout="mono")
        frame.rate = rate
        out.mux([*stream.encode(frame), *stream.encode(None)])
    return file.getvalue()


def is_the_tone(recording: Recording) -> bool:
    spectrum = np.abs(np.fft.rfft(recording.pcm, recording.rate))
    peak = np.abs(recording.pcm.astype(int)).max() / 32767
    return abs(int(spectrum.argmax()) - 440) <= 2 and abs(peak - 0.5) < 0.05


@each_row(
    "kind, codec",
    [
        ("flac", "flac"),
        ("ogg", "libopus"),
        ("mp3", "libmp3lame"),
        ("mp2", "mp2"),
        ("webm", "libopus"),
        ("ipod", "aac"),  # .m4a
        ("adts", "aac"),
        ("aiff", "pcm_s16be"),
        ("au", "pcm_mulaw"),
        ("caf", "pcm_s16be"),
        ("w64", "pcm_s16le"),
        ("wv", "wavpack"),
        ("wav", "adpcm_ms"),
        ("wav", "adpcm_ima_wav"),
        ("wav", "pcm_alaw"),
    ],
)
def test_read_sound_reads_every_format(kind: str, codec: str) -> None:
    recording = read_sound(encoded(kind, codec))
    assert recording.rate == 48_000
    assert len(recording.pcm) == pytest.approx(24_000, abs=2500)
    assert is_the_tone(recording)


def test_read_sound_reads_files_whose_tags_are_not_utf_8() -> None:
    flac = encoded("flac", "flac", tags={"TITLE": "M?elodie"}).replace(b"M?elodie", b"M\xe9lodie\xff")
    assert b"\xe9lodie" in flac
    assert is_the_tone(read_sound(flac))
    frame = b"TIT2" + struct.pack(">I", 9) + b"\0\0" + b"\x03M\xe9lodie\xff"
    id3 = b"ID3\4\0\0" + struct.pack(">I", len(frame)) + frame
    sound = encoded("mp3", "libmp3lame")
    for content in (id3 + sound, id3 + encoded("flac", "flac"), id3 + encoded("adts", "aac")):
        assert is_the_tone(read_sound(content))


def test_read_sound_reads_files_that_were_joined_with_others() -> None:
    """The rate and the channels change in the middle."""
    file = io.BytesIO()
    with av.open(file, "w", format="mp3") as out:
        stream = out.add_stream("libmp3lame", rate=44_100, layout="stereo")
        frame = av.AudioFrame.from_ndarray(np.zeros((2, 44_100), np.float32), format="fltp", layout="stereo")
        frame.rate = 44_100
        out.mux([*stream.encode(frame), *stream.encode(None)])
    recording = read_sound(encoded("mp3", "libmp3lame") + file.getvalue())
    assert len(recording.pcm) / recording.rate == pytest.approx(1.5, abs=0.1)


@given(st.data())
def test_read_sound_of_damaged_files_reads_or_refuses(data: st.DataObject) -> None:
    content = bytearray(data.draw(st.sampled_from(SMALL)))
    for _ in range(data.draw(st.integers(1, 6))):
        content[data.draw(st.integers(0, min(400, len(content) - 1)))] = data.draw(st.integers(0, 255))
    try:
        recording = read_sound(bytes(content))
    except RealizerError:
        return
    assert len(recording.pcm)


SMALL = [
    encoded(kind, codec, 8000, {"TITLE": "a tag"})
    for kind, codec in (("flac", "flac"), ("mp3", "libmp3lame"), ("ipod", "aac"), ("wav", "adpcm_ms"))
]


@pytest.mark.parametrize(
    "content", [b"ID3 is no music", b"OggS" + b"\0" * 40, b"fLaC", b"RIFF", b"", b"#EXTM3U\nx"]
)
def test_read_sound_refuses_other_files(content) -> None:
    with pytest.raises(RealizerError, match="wanted"):
        read_sound(content)


TONE = tone(0.1)


def coded(bits: int, coding: int = 1, values: np.ndarray = TONE) -> bytes:
    if coding == 3:
        return values.astype(f"<f{bits // 8}").tobytes()
    if bits == 8:
        return (np.rint(values * 127) + 128).astype(np.uint8).tobytes()
    whole = np.rint(values * (2 ** (bits - 1) - 1)).astype("<i4")
    if bits == 24:
        return whole.view(np.uint8).reshape(-1, 4)[:, :3].tobytes()
    return whole.astype(f"<i{bits // 8}").tobytes()


@pytest.mark.parametrize(
    ("bits", "coding", "within"), [(8, 1, 260), (16, 1, 1), (24, 1, 1), (32, 1, 1), (32, 3, 1), (64, 3, 1)]
)
def test_read_wav_gives_the_same_sound_for_every_coding(bits: int, coding: int, within: int) -> None:
    recording = read_wav(wav(coded(bits, coding), bits=bits, coding=coding))
    assert recording.rate == 8000
    assert recording.pcm.dtype == np.int16
    np.testing.assert_allclose(recording.pcm, TONE * 32767, atol=within)


def test_read_wav_mixes_channels() -> None:
    both = np.stack([TONE, np.zeros_like(TONE)], axis=1).ravel()
    recording = read_wav(wav(coded(16, values=both), channels=2, rate=44100))
    assert recording.rate == 44100
    np.testing.assert_allclose(recording.pcm, TONE * 32767 / 2, atol=1)


@each_row("codec", ["wav", "flac"])
def test_read_sound_keeps_the_loudest_channel_of_opposite_phases(codec: str) -> None:
    both = np.stack([TONE, -0.9 * TONE], axis=1)
    content = wav(coded(16, values=both.ravel()), channels=2)
    if codec == "flac":
        file = io.BytesIO()
        with av.open(file, "w", format="flac") as out:
            stream = out.add_stream("flac", rate=8000, layout="stereo")
            pcm = np.rint(both * 32767).astype(np.int16).reshape(1, -1)
            frame = av.AudioFrame.from_ndarray(pcm, format="s16", layout="stereo")
            frame.rate = 8000
            out.mux([*stream.encode(frame), *stream.encode(None)])
        content = file.getvalue()
    np.testing.assert_allclose(read_sound(content).pcm, TONE * 32767, atol=1)


@each_row("peak, warned", [(0.5, False), (1.0, False), (1.5, False), (4.0, True), (32768.0, True)])
def test_read_wav_scales_floats_beyond_full_scale(peak: float, warned: bool) -> None:
    recording = read_wav(wav(coded(32, 3, TONE / 0.5 * peak), bits=32, coding=3))
    np.testing.assert_allclose(recording.pcm, TONE / 0.5 * min(peak, 1.0) * 32767, atol=2)
    assert [f"got up to {peak:.3g}" in text for text in recording.warnings] == [True] * warned


def test_read_wav_takes_floats_that_are_no_numbers_as_silence() -> None:
    values = np.append(TONE, [np.nan, np.inf, -np.inf])
    assert read_wav(wav(coded(32, 3, values), bits=32, coding=3)).pcm[-3:].tolist() == [0, 0, 0]


@each_row("size", [0, 0xFFFFFFFF, 0x7FFFF000])
def test_read_wav_reads_the_header_of_a_pipe(size: int) -> None:
    content = wav(coded(16))
    at = content.index(b"data") + 4
    piped = (
        content[:4] + struct.pack("<I", size) + content[8:at] + struct.pack("<I", size) + content[at + 4 :]
    )
    np.testing.assert_allclose(read_wav(piped).pcm, TONE * 32767, atol=1)


def test_read_wav_without_samples_before_another_chunk_is_refused() -> None:
    with pytest.raises(RealizerError, match="without samples"):
        read_wav(wav(b"") + b"LIST" + struct.pack("<I", 4) + b"INFO")


def test_read_wav_reads_files_of_the_standard_library() -> None:
    file = io.BytesIO()
    with wave.open(file, "wb") as out:
        out.setparams((1, 3, 22050, 0, "NONE", ""))
        out.writeframes(coded(24))
    recording = read_wav(file.getvalue())
    assert (recording.rate, len(recording.pcm)) == (22050, len(TONE))


def test_read_wav_reads_the_extensible_header() -> None:
    form = struct.pack("<HHIIHH", 0xFFFE, 1, 8000, 24000, 3, 24) + struct.pack("<HHI", 22, 24, 4)
    form += struct.pack("<H", 1) + bytes.fromhex("000000001000800000aa00389b71")
    data = coded(24)
    chunks = b"fmt " + struct.pack("<I", len(form)) + form + b"LIST\3\0\0\0abc\0"
    chunks += b"data" + struct.pack("<I", len(data)) + data
    recording = read_wav(b"RIFF" + struct.pack("<I", 4 + len(chunks)) + b"WAVE" + chunks)
    np.testing.assert_allclose(recording.pcm, TONE * 32767, atol=1)


def test_read_wav_of_a_cut_file_gives_what_is_left() -> None:
    recording = read_wav(wav(coded(16))[:-101])
    assert len(recording.pcm) == len(TONE) - 51


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (b"no sound at all", "wanted a WAV file, got one that begins with b'no sound'"),
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
        recording = read_wav(bytes(content[: data.draw(st.integers(0, len(content)))]))
    except RealizerError:
        return
    assert recording.pcm.dtype == np.int16
    assert len(recording.pcm)
