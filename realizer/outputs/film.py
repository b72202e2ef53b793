"""The outputs .mp4 (H.264, AAC) and .webm (VP9, Opus), with sound and subtitles."""

from __future__ import annotations

import logging
from collections.abc import Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from realizer.core.array_types import Int16, UInt8
from realizer.core.atomic_files import replacing
from realizer.core.errors import RealizerError
from realizer.outputs.captions import Track, captions
from realizer.outputs.output import Output, RenderSettings
from realizer.outputs.speech_spans import Span

if TYPE_CHECKING:
    from realizer.realization import Realization

log = logging.getLogger(__name__)

RATE = 48000  # Hz; a rate of both AAC and Opus that every player supports
REPORT = 250  # frames between two lines of progress: 10 s of film
# FFmpeg's number for ITU-R BT.709 in matrix, primaries and transfer; the colours of untagged films depend on
# the player.
BT709 = 1


@dataclass(frozen=True)
class Format:
    """The encoders of a film file.

    Attributes:
        container, video, audio, subtitles: FFmpeg's names.
        options: of the video encoder, in addition to `VIDEO`.
    """

    container: str
    video: str
    audio: str
    subtitles: str
    bit_rate: int
    options: Mapping[str, str]
    container_options: Mapping[str, str] = field(default_factory=dict)


# Options of all video encoders. Threads are fixed, so that two machines write the same bytes.
VIDEO = {"threads": "2", "g": "50"}
FORMATS: Mapping[str, Format] = {
    ".mp4": Format(
        "mp4",
        "libx264",
        "aac",
        "mov_text",
        96_000,
        {"preset": "veryfast", "crf": "19", "bf": "2"},
        {"movflags": "+faststart"},
    ),
    ".webm": Format(
        "webm",
        "libvpx-vp9",
        "libopus",
        "webvtt",
        64_000,
        {"deadline": "realtime", "cpu-used": "7", "crf": "28", "b": "0", "row-mt": "1"},
    ),
}


def encode_film(
    path: Path,
    form: Format,
    pictures: Iterable[UInt8],
    count: int,
    fps: float,
    sound: Int16,
    rate: int = RATE,
    lines: Sequence[Span] = (),
) -> None:
    """Write a film with picture k at k / fps and the first sample at 0.

    The sound is padded with silence to the end of the last picture, so that there always is a sound track.

    Args:
        pictures: `count` times (h, w, 3) uint8; an odd last row or column is cut off, as 4:2:0 requires.
        sound: (n,) int16 mono at `rate`.
        lines: subtitles, in order; without any there is no subtitle track.

    Raises:
        RealizerError: if PyAV is not installed, or lacks an encoder.
    """
    av = _av()
    pace = Fraction(fps).limit_denominator(1001)
    length = round(count / pace * rate)
    pcm = np.zeros(length, np.int16)
    pcm[: min(len(sound), length)] = sound[:length]
    video_options = {**VIDEO, **form.options, **_steady(form.video)}
    # Omits the writer's version and random identifiers.
    container_options = {"fflags": "+bitexact", **form.container_options}
    try:
        with av.open(str(path), "w", format=form.container, options=container_options) as film:
            video = film.add_stream(form.video, rate=pace, options=video_options)
            audio = film.add_stream(form.audio, rate=rate, layout="mono")
            audio.bit_rate = form.bit_rate
            # Without this, encoders write their version into the stream, or choose threads by the machine.
            for stream in (video, audio):
                stream.codec_context.flags |= av.codec.context.Flags.bitexact
            track = Track(av, film, form.subtitles, lines, float(count / pace)) if lines else None
            heard = 0
            # A new one for each frame would cost as much as converting.
            converter = av.video.reformatter.VideoReformatter()
            for k, picture in enumerate(pictures):
                height, width = picture.shape[0] // 2 * 2, picture.shape[1] // 2 * 2
                if k == 0:
                    video.width, video.height, video.pix_fmt = width, height, "yuv420p"
                    context = video.codec_context
                    context.time_base = 1 / pace
                    context.colorspace = context.color_primaries = context.color_trc = BT709
                    context.color_range = 1  # 16..235, as players expect
                frame = av.VideoFrame.from_ndarray(
                    np.ascontiguousarray(picture[:height, :width]), format="rgb24"
                )
                frame = converter.reformat(
                    frame, format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG"
                )
                frame.pts, frame.time_base = k, 1 / pace
                film.mux(video.encode(frame))
                until = round((k + 1) / pace * rate)
                if until > heard:
                    part = np.ascontiguousarray(pcm[None, heard:until])
                    sample = av.AudioFrame.from_ndarray(part, format="s16", layout="mono")
                    sample.sample_rate, sample.pts, sample.time_base = rate, heard, Fraction(1, rate)
                    film.mux(audio.encode(sample))
                    heard = until
                if track is not None:
                    track.write(float((k + 1) / pace))
                if (k + 1) % REPORT == 0:
                    log.info("film: %d of %d pictures", k + 1, count)
            film.mux(video.encode(None))
            film.mux(audio.encode(None))
    except (av.error.FFmpegError, ValueError) as error:
        raise RealizerError(f"the film could not be written: {error}") from error


@cache
def _steady(encoder: str) -> dict[str, str]:
    """Return options that make an encoder deterministic.

    x264's AVX-512 code is not (core 165: 12 runs, 8 results); its AVX2 code is.
    """
    if encoder != "libx264":
        return {}
    try:
        wide = "avx512" in Path("/proc/cpuinfo").read_text("utf-8", "replace")
    except OSError:
        wide = False
    return {"x264-params": "asm=AVX2"} if wide else {}


def write_film(realization: Realization, path: Path, drawing: RenderSettings) -> None:
    """Write a film while its pictures are drawn a batch ahead."""
    _av()  # before the drawing starts
    form = FORMATS[Path(path).suffix.lower()]
    size, _ = _picture_size(drawing)
    count = realization.frames
    with replacing(path) as draft, closing(drawing.pictures(realization, size, range(count))) as pictures:
        sound, lines = realization.sound(RATE), captions(realization)
        encode_film(draft, form, pictures, count, realization.fps, sound, lines=lines)


def _picture_size(drawing: RenderSettings) -> tuple[tuple[int, int], bool]:
    width, height = drawing.size
    return (width + width % 2, height + height % 2), False  # 4:2:0 requires even sizes


def _av() -> Any:
    try:
        import av
    except ImportError:
        raise RealizerError("films need PyAV: pip install 'bml-realizer[film]'") from None
    return av


def _output(suffix: str, media_type: str, description: str) -> Output:
    def encode(realization: Realization, drawing: RenderSettings) -> bytes:
        with TemporaryDirectory(prefix="realizer-") as folder:  # FFmpeg seeks back to the start of a film
            path = Path(folder) / f"film{suffix}"
            write_film(realization, path, drawing)
            return path.read_bytes()

    return Output(suffix, media_type, description, encode, ("render", "film"), _picture_size, save=write_film)


MP4 = _output(".mp4", "video/mp4", "film with sound and subtitles, H.264 and AAC")
WEBM = _output(".webm", "video/webm", "film with sound and subtitles, VP9 and Opus")
