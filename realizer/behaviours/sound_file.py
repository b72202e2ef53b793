"""A reader of sound files: WAV by our own code, other formats by PyAV."""

import importlib.util
import io
import struct
from collections.abc import Iterator
from itertools import chain

import numpy as np

from realizer.core.array_types import Float32, Int16
from realizer.core.errors import RealizerError
from realizer.speech.utterance import RATES, Recording

# First bytes of a file -> FFmpeg's name of its format. The format is always given, because FFmpeg would
# also read playlists, which lead to other files.
KINDS = (
    (b"fLaC", "flac"),
    (b"OggS", "ogg"),
    (b"ID3", "mp3"),
    (b"\xff\xfb", "mp3"),
    (b"\xff\xfa", "mp3"),
    (b"\xff\xf3", "mp3"),
    (b"\xff\xf2", "mp3"),
    (b"\x1aE\xdf\xa3", "matroska"),
)
LONGEST = 1800.0  # s; a small file can contain days of silence
INSTALL = "wanted a WAV file, or pip install 'bml-realizer[film]' for {}"


def read_sound(content: bytes) -> Recording:
    """Read WAV, or FLAC, Ogg (Opus, Vorbis), MP3 or WebM by PyAV; all channels are mixed to one.

    Raises:
        RealizerError: no sound, or a format that cannot be read.
    """
    kind = next((kind for begin, kind in KINDS if content.startswith(begin)), None)
    if kind is None:
        return Recording(*read_wav(content))
    if importlib.util.find_spec("av") is None:
        raise RealizerError(INSTALL.format(kind))
    return Recording(*_decoded(content, kind))


def _decoded(content: bytes, kind: str) -> tuple[int, Int16]:
    import av
    from av.audio.resampler import AudioResampler
    from av.error import FFmpegError

    pieces: list[Int16] = []
    rate, count = 0, 0
    try:
        with av.open(io.BytesIO(content), mode="r", format=kind) as file:
            if not file.streams.audio:
                raise RealizerError(f"wanted sound, got a {kind} file without any")
            rate = file.streams.audio[0].rate
            if not RATES[0] <= rate <= RATES[1]:
                raise RealizerError(f"wanted {RATES[0]}..{RATES[1]} Hz, got {rate} Hz")
            to_mono = AudioResampler(format="s16", layout="mono", rate=rate)
            for frame in chain(file.decode(audio=0), [None]):
                parts = [part.to_ndarray()[0].astype(np.int16) for part in to_mono.resample(frame)]
                pieces += parts
                count += sum(map(len, parts))
                if count > LONGEST * rate:
                    raise RealizerError(f"wanted at most {LONGEST:g} s of sound, got more")
    except FFmpegError as error:
        words = error.strerror or type(error).__name__
        raise RealizerError(f"wanted a WAV file, or {kind} that can be read, got {words.lower()}") from None
    if not count:
        raise RealizerError(f"wanted sound, got a {kind} file without samples")
    return rate, np.concatenate(pieces)


PCM, FLOAT, EXTENSIBLE = 1, 3, 0xFFFE
SUPPORTED = "PCM of 8, 16, 24 or 32 bits, or 32-bit floats"


# Not the standard library's `wave`: before Python 3.12 it refuses the extensible header, which most programs
# write for 24 bits, and it cannot read floats.
def read_wav(content: bytes) -> tuple[int, Int16]:
    """Return sample rate in Hz and (n,) int16 samples, the mean of all channels, or raise RealizerError."""
    chunks = dict(reversed(list(_chunks(content))))  # the first of each name counts
    if b"fmt " not in chunks or b"data" not in chunks or len(chunks[b"fmt "]) < 16:
        raise RealizerError("wanted a WAV file with a format and data, got one without")
    form = chunks[b"fmt "]
    coding, channels, rate, _, block, bits = struct.unpack_from("<HHIIHH", form)
    if coding == EXTENSIBLE and len(form) >= 26:
        coding = struct.unpack_from("<H", form, 24)[0]
    if (coding, bits) not in {(PCM, 8), (PCM, 16), (PCM, 24), (PCM, 32), (FLOAT, 32)}:
        raise RealizerError(f"wanted {SUPPORTED}, got coding {coding} of {bits} bits")
    if not (1 <= channels <= 64 and RATES[0] <= rate <= RATES[1] and block == channels * bits // 8):
        raise RealizerError(
            f"wanted 1..64 channels at {RATES[0]}..{RATES[1]} Hz, "
            f"got {channels} at {rate} Hz, {block} bytes a frame"
        )
    data = chunks[b"data"]
    count = len(data) // block
    if not count:
        raise RealizerError("wanted sound, got a WAV file without samples")
    samples = _samples(data[: count * block], coding, bits).reshape(count, channels)
    mono = samples[:, 0] if channels == 1 else samples.mean(axis=1, dtype=np.float32)
    return rate, np.clip(np.rint(mono), -32768, 32767).astype(np.int16)


def _chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield the name and content of each chunk; a chunk may be cut off at the end."""
    if content[:4] != b"RIFF" or content[8:12] != b"WAVE":
        got = f"one that begins with {content[:8]!r}" if content else "an empty one"
        raise RealizerError(f"wanted a WAV, FLAC, Ogg, MP3 or WebM file, got {got}")
    at = 12
    while at + 8 <= len(content):
        name, size = struct.unpack_from("<4sI", content, at)
        yield name, content[at + 8 : at + 8 + size]
        at += 8 + size + size % 2


def _samples(data: bytes, coding: int, bits: int) -> Float32:
    if coding == FLOAT:
        floats = np.frombuffer(data, "<f4")
        scaled: Float32 = np.nan_to_num(np.clip(floats, -1, 1), nan=0.0) * np.float32(32767)
        return scaled
    if bits == 8:
        return (np.frombuffer(data, np.uint8).astype(np.float32) - np.float32(128)) * np.float32(256)
    if bits == 24:
        # The upper two bytes and the part that the lowest adds.
        parts = np.frombuffer(data, np.uint8).reshape(-1, 3)
        high = np.ascontiguousarray(parts[:, 1:]).view("<i2")[:, 0].astype(np.float32)
        return high + parts[:, 0].astype(np.float32) / np.float32(256)
    whole: Float32 = np.frombuffer(data, "<i2" if bits == 16 else "<i4").astype(np.float32)
    return whole if bits == 16 else whole / np.float32(65536)
