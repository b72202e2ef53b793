"""A reader of sound files: WAV by our own code, other formats by PyAV."""

import importlib.util
import io
import re
import struct
from collections.abc import Callable, Iterable, Iterator
from itertools import chain
from typing import Any

import numpy as np

from realizer.core.array_types import Float32
from realizer.core.errors import RealizerError
from realizer.core.sound_formats import format_of, without_id3
from realizer.speech.utterance import RATES, Recording

LONGEST = 1800.0  # s; a small file can contain days of silence
LISTED = "WAV, FLAC, Ogg, MP3, M4A, AIFF or WebM"
INSTALL = "wanted a WAV file of " + "{}, or pip install 'bml-realizer[film]' for {}"
# The least energy of the mean of channels, of what it would be for unrelated channels: below it they are in
# opposite phase, as with a cable that is wired wrongly.
LEAST_SUM = 0.5
FULL = 32768.0  # full scale
LARGEST = 1e30  # of floats; beyond it sums overflow
LOUDEST = 2.0  # of full scale; programs that write floats exceed it by a little


def read_sound(content: bytes) -> Recording:
    """Read WAV, or another format by PyAV; all channels are mixed to one.

    Where the mean of the channels loses most of the sound, because their phase is opposite, it is that of the
    loudest channel. Sound beyond full scale is made quieter, with a warning if it is far beyond.

    Raises:
        RealizerError: no sound, or a format that cannot be read.
    """
    content = without_id3(content)
    kind = format_of(content)
    if kind is None:
        got = f"one that begins with {content[:8]!r}" if content else "an empty one"
        raise RealizerError(f"wanted a sound file ({LISTED}), got {got}")
    if kind != "wav":
        return _decoded(content, kind)
    try:
        return read_wav(content)
    except RealizerError as error:
        if importlib.util.find_spec("av") is None:
            raise
        try:
            return _decoded(content, kind)  # compressed, of another byte order, or with 64-bit sizes
        except RealizerError:
            raise error from None


def _decoded(content: bytes, kind: str) -> Recording:
    """Decode with PyAV; whatever fails in it is a RealizerError."""
    if importlib.util.find_spec("av") is None:
        raise RealizerError(INSTALL.format(SUPPORTED, kind))
    rate = 0

    def pieces() -> Iterator[Float32]:
        nonlocal rate
        length = 0
        for found, piece in _frames(content, kind):
            rate, length = found, length + piece.shape[1]
            if length > LONGEST * rate:
                raise RealizerError(f"wanted at most {LONGEST:g} s of sound, got more")
            yield _scaled(piece)

    try:
        mixed = _mixed(pieces)
    except RealizerError:
        raise
    # FFmpeg's own errors are not all that damaged files cause, such as UnicodeDecodeError for tags.
    except Exception as error:
        words = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise RealizerError(f"wanted a {kind} file that can be read, got {words.lower()}") from None
    if not len(mixed):
        raise RealizerError(f"wanted sound, got a {kind} file without samples")
    return _recording(rate, mixed)


def _frames(content: bytes, kind: str) -> Iterator[tuple[int, Float32]]:
    """Yield the rate in Hz and (channels, n) samples, both as in the first frame of the file."""
    import av
    from av.audio.resampler import AudioResampler

    # Tags are not needed, and many are in another encoding than they say.
    with av.open(io.BytesIO(content), mode="r", format=kind, metadata_errors="replace") as file:
        if not file.streams.audio:
            raise RealizerError(f"wanted sound, got a {kind} file without any")
        first: Any = None
        setup: Any = None
        resampler: Any = None
        for frame in chain(_whole(file), [None]):
            now = frame and (frame.format.name, frame.layout.name, frame.rate)
            if now != setup:  # files that were joined change it
                if first is None:
                    first = frame
                    if not RATES[0] <= first.rate <= RATES[1]:
                        raise RealizerError(f"wanted {RATES[0]}..{RATES[1]} Hz, got {first.rate} Hz")
                flushed = [] if resampler is None else resampler.resample(None)
                yield from ((first.rate, part.to_ndarray()) for part in flushed)
                resampler = AudioResampler(format="fltp", layout=first.layout, rate=first.rate)
                setup = now
            if frame is not None:
                frame.pts = None  # gaps are no silence
                yield from ((first.rate, part.to_ndarray()) for part in resampler.resample(frame))


def _whole(file: Any) -> Iterator[Any]:
    """Yield the frames that can be decoded, as players do; raise the last error if there are none."""
    from av.error import FFmpegError

    fault, count = None, 0
    for packet in file.demux(audio=0):
        try:
            frames = packet.decode()
        except FFmpegError as error:
            fault = error
            continue
        count += len(frames)
        yield from frames
    if fault is not None and not count:
        raise fault


def _scaled(floats: Any) -> Float32:
    """Return floats of -1..1 as int16 samples would be; what is no number is 0."""
    finite = np.where(np.abs(floats) < LARGEST, floats, 0.0)  # False for NaN
    return (finite * FULL).astype(np.float32)


def _mixed(pieces: Callable[[], Iterable[Float32]]) -> Float32:
    """Return (n,) samples: the mean of (channels, n) pieces, or the loudest channel if that loses sound."""
    means: list[Float32] = [np.zeros(0, np.float32)]
    energies = np.zeros(1)
    for piece in pieces():
        means.append(piece[0] if len(piece) == 1 else piece.mean(axis=0, dtype=np.float32))
        if len(piece) > 1:
            energies = energies + np.square(piece, dtype=np.float64).sum(axis=1)
    mixed = np.concatenate(means)
    if np.square(mixed, dtype=np.float64).sum() >= LEAST_SUM * energies.sum() / len(energies) ** 2:
        return mixed
    loudest = int(energies.argmax())
    return np.concatenate([piece[loudest] for piece in pieces()])


def _recording(rate: int, samples: Float32) -> Recording:
    peak = float(np.abs(samples).max())
    if peak > FULL:
        samples = samples * np.float32(FULL / peak)
    pcm = np.clip(np.rint(samples), -32768, 32767).astype(np.int16)
    if peak <= LOUDEST * FULL:
        return Recording(rate, pcm)
    text = f"wanted samples of -1..1, got up to {peak / FULL:.3g}: the sound is scaled to fit"
    return Recording(rate, pcm, warnings=(text,))


PCM, FLOAT, EXTENSIBLE = 1, 3, 0xFFFE
SUPPORTED = "PCM of 8, 16, 24 or 32 bits, or floats of 32 or 64 bits"
CHUNK = re.compile(rb"[A-Za-z0-9 ]{4}")


# Not the standard library's `wave`: before Python 3.12 it refuses the extensible header, which most programs
# write for 24 bits, and it cannot read floats.
def read_wav(content: bytes) -> Recording:
    """Return the sound of a WAV file, mixed as by `read_sound`, or raise RealizerError."""
    chunks = dict(reversed(list(_chunks(content))))  # the first of each name counts
    if b"fmt " not in chunks or b"data" not in chunks or len(chunks[b"fmt "]) < 16:
        raise RealizerError("wanted a WAV file with a format and data, got one without")
    form = chunks[b"fmt "]
    coding, channels, rate, _, block, bits = struct.unpack_from("<HHIIHH", form)
    if coding == EXTENSIBLE and len(form) >= 26:
        coding = struct.unpack_from("<H", form, 24)[0]
    if (coding, bits) not in {(PCM, 8), (PCM, 16), (PCM, 24), (PCM, 32), (FLOAT, 32), (FLOAT, 64)}:
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
    samples = _samples(data[: count * block], coding, bits).reshape(count, channels).T
    return _recording(rate, _mixed(lambda: (samples,)))


def _chunks(content: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Yield the name and content of each chunk; a chunk may be cut off at the end."""
    if content[:4] != b"RIFF" or content[8:12] != b"WAVE":
        raise RealizerError(f"wanted a WAV file, got one that begins with {content[:8]!r}")
    at = 12
    while at + 8 <= len(content):
        name, size = struct.unpack_from("<4sI", content, at)
        # A program that writes to a pipe leaves 0, or a size beyond the end.
        if name == b"data" and not size and not CHUNK.match(content, at + 8):
            size = len(content)
        yield name, content[at + 8 : at + 8 + size]
        at += 8 + size + size % 2


def _samples(data: bytes, coding: int, bits: int) -> Float32:
    if coding == FLOAT:
        return _scaled(np.frombuffer(data, f"<f{bits // 8}"))
    if bits == 8:
        return (np.frombuffer(data, np.uint8).astype(np.float32) - np.float32(128)) * np.float32(256)
    if bits == 24:
        # The upper two bytes and the part that the lowest adds.
        parts = np.frombuffer(data, np.uint8).reshape(-1, 3)
        high = np.ascontiguousarray(parts[:, 1:]).view("<i2")[:, 0].astype(np.float32)
        return high + parts[:, 0].astype(np.float32) / np.float32(256)
    whole: Float32 = np.frombuffer(data, "<i2" if bits == 16 else "<i4").astype(np.float32)
    return whole if bits == 16 else whole / np.float32(65536)
