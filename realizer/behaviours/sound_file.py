"""A reader of sound files: WAV by our own code, other formats by PyAV."""

from __future__ import annotations

import importlib.util
import io
from itertools import chain

import numpy as np

from realizer.behaviours.wav_file import read_wav
from realizer.core.array_types import Int16
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
