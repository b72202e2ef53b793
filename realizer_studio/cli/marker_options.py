"""Options of the commands that track painted markers."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import options
from realizer.cli.options import option
from realizer.cli.progress import bar

if TYPE_CHECKING:
    from realizer_studio.tracking.markers.film import Markers, MarkerSettings


class Numbers(click.ParamType):  # type: ignore[type-arg]
    """The type of options for whole numbers of pixels with commas between them."""

    def __init__(self, name: str) -> None:
        self.name = name

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> Any:
        cells = str(value).split(",")
        if len(cells) != self.name.count(",") + 1 or not all(cell.strip().isdecimal() for cell in cells):
            self.fail(f"wanted {self.name} in pixels, got {value!r}", parameter, context)
        return tuple(map(int, cells))


marker_options = options.several(
    option(
        "--markers COLOURS",
        "Follow painted markers of these colours: red, yellow, green, cyan, blue, magenta, with "
        "commas. The second colour is that of painted lids.",
    ),
    option(
        "--marker-colour H,S,V",
        "A colour of markers: degrees and per cent, and if you like the three spreads.",
        multiple=True,
    ),
    option(
        "--marker-at X,Y",
        "A pixel in a marker of the first picture (or picture N of --neutral), to learn its colour "
        "from; several are better.",
        Numbers("X,Y"),
        multiple=True,
    ),
    option(
        "--layout FILE.csv",
        "Names and places of the markers.  [default: Wojdel's 31, or numbers from the upper left]",
        options.FILE,
    ),
    option(
        "--region L,T,R,B",
        "Part of the pictures, in pixels, that has the markers.",
        Numbers("LEFT,TOP,RIGHT,BOTTOM"),
    ),
)


def marker_settings(source: Path, chosen: dict[str, Any], neutral: int | None) -> MarkerSettings | None:
    """Return the settings for tracking markers from the values of `marker_options`, or None without markers.

    Raises:
        TrackingError: invalid values.
    """
    from realizer_studio.tracking.markers import colours
    from realizer_studio.tracking.markers.film import MarkerSettings
    from realizer_studio.tracking.markers.layout import read_layout
    from realizer_studio.tracking.pictures import read_pictures

    layout, region = chosen["layout"], chosen["region"]
    found = [colours.named(name) for name in (chosen["markers"] or "").split(",") if name.strip()]
    found += [colours.of_numbers(text) for text in chosen["marker_colour"]]
    if chosen["marker_at"]:
        picture = next(islice(read_pictures(source)[1], neutral or 0, None), None)
        if picture is None:
            raise click.BadParameter(f"there is no picture {neutral} in {source}", param_hint="--neutral")
        found += colours.learnt(picture.image, chosen["marker_at"], picture.name)
    if region is not None and not (region[0] < region[2] and region[1] < region[3]):
        raise click.BadParameter(
            f"wanted a left below the right and a top below the bottom, got {region}", param_hint="--region"
        )
    if not found:
        if layout is not None or region is not None:
            raise click.UsageError("--layout and --region are for markers; see --markers")
        return None
    return MarkerSettings(found, read_layout(layout) if layout is not None else None, region, neutral)


def follow(source: Path, settings: MarkerSettings, fps: float | None) -> Markers:
    """Return the markers of a film, with a progress bar."""
    from realizer_studio.tracking.markers.film import track_markers
    from realizer_studio.tracking.pictures import read_pictures

    count, pictures = read_pictures(source, fps or 25.0)
    with bar(pictures, count, "markers", least=2) as shown:
        return track_markers(shown, settings, str(source), fps)
