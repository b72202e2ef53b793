"""`track`: converts tracked feature points to a FAP file."""

from __future__ import annotations

from itertools import groupby
from pathlib import Path
from typing import TYPE_CHECKING

import click

from realizer.cli import options

if TYPE_CHECKING:
    from realizer.core.array_types import Float64
    from realizer.face.model import Fapu


@click.command()
@click.argument("points", type=click.Path(exists=True, dir_okay=False, allow_dash=True))
@click.option(
    "-o",
    "--output",
    required=True,
    metavar="OUT.fap",
    type=click.Path(path_type=Path),
    help="Where the FAPs go.",
)
@click.option(
    "--fps", type=options.Number(0.1, 1000), default=25.0, show_default=True, help="Of the tracker."
)
@click.option(
    "--profiles",
    type=click.Choice(["own", "published", "raw"]),
    help="Say which emotions of this set show, and when.",
)
def track(points: str, output: Path, fps: float, profiles: str | None) -> None:
    """Turn tracked feature points into FAPs, for any face to play.

    POINTS is a table frame,point,x,y,z: points as MPEG-4 names them, metres, x to the character's left, y up,
    z forward. Frame 0 is the face at rest, from which its proportions are measured: it needs 2.2, 3.1 to 3.6,
    8.3, 8.4 and 9.15. Where the head is and how it turns does not matter, given corners of the eyes or points
    of the forehead (11.1 to 11.6). A point that a frame does not list goes straight to where it is seen next.

    \b
    realizer track actor.csv --fps 30 -o actor.fap
    """
    import numpy as np

    from realizer.analysis.faps_from_points import faps_from_points
    from realizer.analysis.points_file import bridge, read_points
    from realizer.analysis.recognise import recogniser
    from realizer.animation.fap.fap_clip import FAPClip
    from realizer.animation.frames import FAPFrames
    from realizer.outputs.fap_text import encode

    if output.suffix.lower() != ".fap":
        raise click.UsageError(f"{output}: wanted a name that ends in .fap")
    (content,) = options.read_documents([points])
    try:
        text = content.decode("utf-8-sig")  # spreadsheets write the mark
    except UnicodeDecodeError as error:
        byte = f"0x{content[error.start]:02X} at {error.start}"
        raise click.UsageError(f"{points}: wanted a table in UTF-8, got byte {byte}") from None
    try:
        moving, rest = read_points(text, points)
        values, seen = faps_from_points(bridge(moving), rest, _fapu(rest, points))
    except ValueError as error:
        raise click.UsageError(str(error)) from None
    times = np.arange(len(values)) / fps
    output.write_text(encode(FAPClip.of(FAPFrames(times, values, seen), fps, output.stem)), "utf-8")
    click.echo(f"{output}: {len(values)} frames, {int(seen.sum())} FAPs", err=True)
    if profiles is not None:
        names = recogniser(profiles).names(values, seen)
        first = 0
        for name, frames in groupby(names):
            count = len(list(frames))
            click.echo(f"{first / fps:8.2f} {(first + count) / fps:8.2f} {name or '-'}")
            first += count


def _fapu(rest: dict[str, Float64], where: str) -> Fapu:
    import numpy as np

    from realizer.core.errors import FaceError
    from realizer.face.features import fapu_of

    try:
        return fapu_of({name: place.astype(np.float32) for name, place in rest.items()}, where)
    except KeyError as missing:
        raise click.UsageError(
            f"{where}: wanted point {missing.args[0]} in frame 0: the face's proportions hang on it"
        ) from None
    except FaceError as error:
        raise click.UsageError(str(error)) from None
