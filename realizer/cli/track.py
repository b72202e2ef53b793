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
    "-o", "--output", required=True, metavar="OUT.fap", type=options.OUTPUT, help="FAP file to write."
)
@click.option(
    "--fps", type=options.Number(0.1, 1000), default=25.0, show_default=True, help="Frame rate of the points."
)
@click.option(
    "--profiles",
    type=click.Choice(["own", "published", "raw"]),
    help="Also print which emotions are recognised, by these profiles, and when.",
)
def track(points: str, output: Path, fps: float, profiles: str | None) -> None:
    """Convert tracked feature points of a face to FAPs, which any face can play.

    POINTS is a CSV table with the columns frame,point,x,y,z: points by their MPEG-4 names, in metres, x to
    the character's left, y up, z forward. Frame 0 shows the face at rest; its proportions are measured from
    points 2.2, 3.1 to 3.6, 8.3, 8.4 and 9.15. Head motion is measured at points 11.1 to 11.6 or the
    corners of the eyes. Points missing from a frame are interpolated.

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

    options.check_suffix(output, ".fap")
    content = options.read_file(points)
    text = options.decode(content, points, "a table")
    with options.reporting(ValueError):
        moving, rest = read_points(text, points)
        values, seen = faps_from_points(bridge(moving), rest, _fapu(rest, points))
    times = np.arange(len(values)) / fps
    output.write_text(encode(FAPClip.of(FAPFrames(times, values, seen), fps, output.stem)), "utf-8")
    options.note(f"{output}: {len(values)} frames, {int(seen.sum())} FAPs")
    if profiles is not None:
        first = 0
        for name, frames in groupby(recogniser(profiles).names(values, seen)):
            end = first + len(list(frames))
            click.echo(f"{first / fps:8.2f} {end / fps:8.2f} {name or '-'}")
            first = end


def _fapu(rest: dict[str, Float64], where: str) -> Fapu:
    import numpy as np

    from realizer.core.errors import FaceError
    from realizer.face.features import fapu_of

    try:
        with options.reporting(FaceError):
            return fapu_of({name: place.astype(np.float32) for name, place in rest.items()}, where)
    except KeyError as missing:
        raise click.UsageError(
            f"{where}: wanted point {missing.args[0]} in frame 0, to measure the face's proportions"
        ) from None
