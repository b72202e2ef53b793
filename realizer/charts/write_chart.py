"""Writing of charts to files; the suffix selects the format."""

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

from realizer.charts.picture import timeline
from realizer.charts.raster import png
from realizer.charts.shapes import Picture
from realizer.charts.svg import svg
from realizer.charts.timeline import BlockChart
from realizer.core.atomic_files import write_bytes

Writer = Callable[[Picture], bytes]
WRITERS: Mapping[str, Writer] = {".svg": lambda picture: svg(picture).encode(), ".png": png}


def writer_for(path: str | Path) -> Writer:
    """Return the encoder of a picture.

    Raises:
        ValueError: no or an unknown suffix; the text lists the known ones.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in WRITERS:
        raise ValueError(f"{path}: wanted a suffix of {' '.join(WRITERS)}, got {suffix or 'none'}")
    return WRITERS[suffix]


def write_timeline(blocks: Sequence[BlockChart], path: str | Path) -> None:
    """Write the picture whole or not at all.

    Raises:
        ValueError: as `writer_for`.
        RealizerError: there is too much of it for that kind of picture.
        OSError: it cannot be written there.
    """
    write = writer_for(path)
    write_bytes(path, write(timeline(blocks)))
