"""Readers of films, pictures, and folders of pictures."""

from __future__ import annotations

import importlib.util
import logging
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from realizer.core.errors import RealizerError
from realizer_studio.tracking.network import TrackingError

if TYPE_CHECKING:
    from PIL.Image import Image

log = logging.getLogger(__name__)

EARLY = 0.5  # s without pictures at the end of a film that cause a warning
MOST_BROKEN = 10_000  # broken parts of a film, after which reading stops
LARGEST = 1920  # pixels; longer sides of photographs are reduced to this
INSTALL = "reading films needs PyAV: pip install 'bml-realizer[track]'"


@dataclass(frozen=True, eq=False, slots=True)
class Picture:
    """A picture of a film or folder."""

    time: float  # seconds from the first
    image: Image  # RGB, upright
    name: str  # file and time, for messages


def read_pictures(path: Path, fps: float = 25.0) -> tuple[int, Iterator[Picture]]:
    """Return the number of pictures, 0 if it is not known, and the pictures of a file or folder.

    Args:
        path: a picture, a film, or a folder of pictures, which are ordered by the numbers in their names.
        fps: the rate of a folder.

    Raises:
        TrackingError: a file cannot be read; also raised by the iterator.
    """
    if path.is_dir():
        files = sorted((file for file in path.iterdir() if is_picture(file)), key=_natural)
        if not files:
            raise TrackingError(f"{path}: wanted a folder of pictures, got none that Pillow can read")
        return len(files), _folder(files, fps)
    if is_picture(path):
        return 1, iter([Picture(0.0, read_picture(path), str(path))])
    return _film(path)


def is_picture(path: Path) -> bool:
    """Return whether a file has the suffix of a picture."""
    from PIL import Image

    Image.init()
    return path.suffix.lower() in Image.EXTENSION and path.is_file()


def read_picture(path: Path) -> Image:
    """Read a picture over black; raises TrackingError if the file is no picture, or truncated."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with Image.open(path) as image:
            image.draft("RGB", (LARGEST, LARGEST))  # decodes JPEG at a reduced size
            upright = ImageOps.exif_transpose(image)
            if upright.mode.startswith("I"):  # 16 bits of grey
                upright = upright.point(lambda value: value / 256).convert("L")
            upright.thumbnail((LARGEST, LARGEST))
            visible = upright.convert("RGBA")
            return Image.alpha_composite(Image.new("RGBA", visible.size, "black"), visible).convert("RGB")
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise TrackingError(
            f"{path}: wanted a picture, got: {error}; copy it again, or save it as JPEG or PNG"
        ) from None


def _folder(files: list[Path], fps: float) -> Iterator[Picture]:
    """Yield the pictures of files; unreadable ones are skipped with a warning.

    Raises:
        TrackingError: all are unreadable.
    """
    found = 0
    for k, file in enumerate(files):
        try:
            picture = read_picture(file)
        except TrackingError as error:
            if k == len(files) - 1 and not found:
                raise
            log.warning("%s; it is left out", error)
            continue
        found += 1
        yield Picture(k / fps, picture, str(file))


def _natural(path: Path) -> list[tuple[int, str]]:
    """Return a sort key by which picture 10 follows picture 9."""
    return [(int(part), "") if part.isdecimal() else (0, part) for part in re.split(r"(\d+)", path.name)]


def _film(path: Path) -> tuple[int, Iterator[Picture]]:
    if importlib.util.find_spec("av") is None:
        raise RealizerError(f"{path}: {INSTALL}")
    if path.stat().st_size == 0:
        raise TrackingError(f"{path}: wanted a film or a picture, got an empty file; copy or record it again")
    import av
    from av.error import FFmpegError

    try:
        # A playlist could name other files, also of other machines.
        container = av.open(str(path), mode="r", options={"protocol_whitelist": "file"})
    except (FFmpegError, OSError) as error:
        raise TrackingError(
            f"{path}: wanted a film or a picture, got: {_words(error)}; if it was cut off, copy or record it "
            "again, else convert it to MP4"
        ) from None
    if not container.streams.video:
        container.close()
        raise TrackingError(f"{path}: wanted a film, got a file without pictures")
    stream = container.streams.video[0]
    length = (
        float((stream.duration or 0) * (stream.time_base or 0)) or (container.duration or 0) / av.time_base
    )
    count = stream.frames or round(length * float(stream.average_rate or 0))

    def frames() -> Iterator[Picture]:
        first, last = 0.0, None
        broken: list[Exception] = []
        with container:
            for k, frame in enumerate(_decoded(container, stream, broken)):
                time = frame.time if frame.time is not None else k / float(stream.average_rate or 25)
                first = time if last is None else first
                if last is not None and time <= last:
                    continue  # broken films repeat times
                last = time
                image: Image = frame.to_image()
                if turn := frame.rotation % 360:
                    image = image.rotate(turn, expand=True)
                image.thumbnail((LARGEST, LARGEST))
                yield Picture(time - first, image, f"{path} at {time - first:.2f} s")
            reason = _words(broken[0]) if broken else "no picture"
            if last is None:
                codec = stream.codec_context.name if stream.codec_context else "an unknown codec"
                raise TrackingError(
                    f"{path}: wanted a film that FFmpeg can decode, got {codec}: {reason}; convert it to "
                    "H.264, or copy or record it again"
                )
            if broken:
                log.warning(
                    "%s: parts of it are broken, %d in all (%s); the rest is kept", path, len(broken), reason
                )
            if last - first < length - EARLY:
                log.warning(
                    "%s: its pictures end at %.1f of %.1f s; it may be cut off", path, last - first, length
                )

    return count, frames()


def _decoded(container: Any, stream: Any, broken: list[Exception]) -> Iterator[Any]:
    """Yield the frames of a film; broken parts are skipped, and their errors added to a list."""
    from av.error import FFmpegError

    packets = container.demux(stream)
    while len(broken) < MOST_BROKEN:
        try:
            packet = next(packets, None)
            if packet is None:
                return
            yield from (frame for frame in packet.decode() if not frame.is_corrupt)
        except (FFmpegError, OSError, ValueError) as error:
            broken.append(error)


def _words(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
