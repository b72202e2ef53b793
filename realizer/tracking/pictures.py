"""Readers of films, pictures, and folders of pictures."""

from __future__ import annotations

import importlib.util
import logging
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from realizer.core.errors import RealizerError
from realizer.tracking.network import TrackingError

if TYPE_CHECKING:
    from PIL.Image import Image

log = logging.getLogger(__name__)

LARGEST = 1920  # pixels; longer sides of photographs are reduced to this, as faces are looked at in 192
INSTALL = "reading films needs PyAV: pip install 'bml-realizer[track]'"


@dataclass(frozen=True, eq=False, slots=True)
class Picture:
    """A picture of a film or folder."""

    time: float  # seconds from the first
    image: Image  # RGB, upright
    name: str  # the file and the time in it, for messages


def read_pictures(path: Path, fps: float = 25.0) -> tuple[int, Iterator[Picture]]:
    """Return the number of pictures, 0 if it is not known, and the pictures of a file or folder.

    Args:
        path: a picture, a film, or a folder of pictures, which are ordered by the numbers in their names.
        fps: of a folder.

    Raises:
        TrackingError: nothing that can be read; the text says which file. Iterating may raise it, too.
    """
    if path.is_dir():
        files = sorted((file for file in path.iterdir() if is_picture(file)), key=_natural)
        if not files:
            raise TrackingError(f"{path}: wanted a folder of pictures, got none that Pillow can read")
        return len(files), (Picture(k / fps, read_picture(file), str(file)) for k, file in enumerate(files))
    if is_picture(path):
        return 1, iter([Picture(0.0, read_picture(path), str(path))])
    return _film(path)


def is_picture(path: Path) -> bool:
    """Return whether the name of a file is that of a picture."""
    from PIL import Image

    Image.init()
    return path.suffix.lower() in Image.EXTENSION and path.is_file()


def read_picture(path: Path) -> Image:
    """Read a picture, transparent parts in black; raises TrackingError if it is none, or cut off."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with Image.open(path) as image:
            image.draft("RGB", (LARGEST, LARGEST))  # JPEG: decode only as fine as wanted
            upright = ImageOps.exif_transpose(image)
            if upright.mode.startswith("I"):  # 16 bits of grey
                upright = upright.point(lambda value: value / 256).convert("L")
            upright.thumbnail((LARGEST, LARGEST))
            visible = upright.convert("RGBA")
            return Image.alpha_composite(Image.new("RGBA", visible.size, "black"), visible).convert("RGB")
    except (UnidentifiedImageError, OSError, ValueError, SyntaxError, Image.DecompressionBombError) as error:
        raise TrackingError(f"{path}: wanted a picture, got: {error}") from None


def _natural(path: Path) -> list[tuple[int, str]]:
    """Return a sort key by which picture 10 follows picture 9."""
    return [(int(part), "") if part.isdecimal() else (0, part) for part in re.split(r"(\d+)", path.name)]


def _film(path: Path) -> tuple[int, Iterator[Picture]]:
    if importlib.util.find_spec("av") is None:
        raise RealizerError(f"{path}: {INSTALL}")
    import av
    from av.error import FFmpegError

    try:
        # A playlist could name other files, also of other machines.
        container = av.open(str(path), mode="r", options={"protocol_whitelist": "file"})
    except (FFmpegError, OSError) as error:
        raise TrackingError(f"{path}: wanted a film or a picture, got: {_words(error)}") from None
    if not container.streams.video:
        container.close()
        raise TrackingError(f"{path}: wanted a film, got a file without pictures")
    stream = container.streams.video[0]
    count = stream.frames or round(
        float((container.duration or 0) * (stream.average_rate or 0)) / av.time_base
    )

    def frames() -> Iterator[Picture]:
        first = last = None
        with container:
            try:
                for k, frame in enumerate(container.decode(stream)):
                    time = frame.time if frame.time is not None else k / float(stream.average_rate or 25)
                    first = time if first is None else first
                    if last is not None and time <= last:
                        continue  # broken films repeat times
                    last = time
                    image: Image = frame.to_image()  # type: ignore[no-untyped-call]
                    if turn := frame.rotation % 360:
                        image = image.rotate(turn, expand=True)
                    image.thumbnail((LARGEST, LARGEST))
                    yield Picture(time - first, image, f"{path} at {time - first:.2f} s")
            except (FFmpegError, OSError, ValueError) as error:
                if last is None:
                    codec = stream.codec_context.name
                    raise TrackingError(
                        f"{path}: wanted a film that FFmpeg can decode, got {codec}: {_words(error)}"
                    ) from None
                log.warning("%s: broken at %.2f s (%s); what came before is kept", path, last, _words(error))
        if last is None:
            raise TrackingError(f"{path}: wanted a film, got one without a single picture")

    return count, frames()


def _words(error: Exception) -> str:
    return getattr(error, "strerror", None) or str(error) or type(error).__name__
