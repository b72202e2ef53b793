"""`track`: converts films, pictures, or tracked feature points to FAPs, action units, or a document."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import click

from realizer.cli import inputs, options
from realizer.cli.options import option
from realizer.cli.progress import bar, note
from realizer.core.errors import FaceError

if TYPE_CHECKING:
    from realizer.core.array_types import Float64
    from realizer.face.model import Fapu
    from realizer_studio.tracking.follower import LandmarkCache, Person
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


def follow_markers(source: Path, settings: MarkerSettings, fps: float | None) -> Markers:
    """Return the markers of a film, with a progress bar."""
    from realizer_studio.tracking.markers.film import track_markers
    from realizer_studio.tracking.pictures import read_pictures

    count, pictures = read_pictures(source, fps or 25.0)
    with bar(pictures, count, "markers", least=2) as shown:
        return track_markers(shown, settings, str(source), fps)


# The text of OUT, its rate, its FAPs, a mask of measured FAPs, and of frames with the face (None for all).
Tracked: TypeAlias = "tuple[str, float, Any, Any, Any]"
POINTS = (".csv", ".txt", "")  # suffixes of tables of points; the last is of standard input


@click.command()
@click.argument("source", metavar="IN", type=click.Path(exists=True, allow_dash=True))
@option("-o --output OUT", "File to write: .fap, .csv, .json, .bml.", options.OUTPUT, required=True)
@option(
    "--fps",
    "Frame rate of points and of a folder of pictures, and of OUT.  [default: the film's, or 25]",
    options.Number(0.1, 1000),
)
@option(
    "--profiles",
    "Also print which emotions are recognised by these profiles (own, published, raw or a file), when "
    "and how certainly.",
    options.ProfileSet(),
)
@option("--face NAME", "Make the FAPs from the action units, by the mapping of this face.")
@option("--neutral N|PICTURE", "The face at rest: a picture, or picture N (from 0) of IN.")
@option("--person", "Which of several people; 1 is seen most.", click.IntRange(1), default=1)
@marker_options
def track(source: str, output: Path, fps: float | None, profiles: str | None, **choices: Any) -> None:
    """Convert a film, a picture, a folder of pictures, or tracked feature points to movements of a face.

    OUT is a FAP file, which any face can play, a table of action units from 0 to 1, both in JSON, or a BML
    document that plays it again. In a film, the face at rest is that of its quietest pictures.

    Points are a CSV table with the columns frame,point,x,y,z, for a .fap: points by their MPEG-4 names, in
    metres, x to the character's left, y up, z forward. Frame 0 shows the face at rest; its proportions are
    measured from points 2.2, 3.1 to 3.6, 8.3, 8.4 and 9.15. Head motion is measured at points 11.1 to 11.6 or
    the corners of the eyes. Points missing from a frame are interpolated.

    With --markers, --marker-colour or --marker-at, painted markers are followed instead of the face. OUT is
    then a table of points, JSON, or FAPs or a document if the layout names feature points.

    \b
    realizer track talk.mp4 -o talk.csv
    realizer track talk.mp4 -o talk.bml && realizer realize talk.bml --face ben -o again.mp4
    realizer track actor.csv --fps 30 -o actor.fap
    realizer track dots.mp4 --markers green,blue -o dots.csv
    """
    from realizer.core.atomic_files import write_bytes

    if source == "-" or (Path(source).suffix.lower() in POINTS and Path(source).is_file()):
        text, rate, values, measured, visible = _from_points(source, output, fps or 25.0)
    else:
        text, rate, values, measured, visible = _from_pictures(Path(source), output, fps, **choices)
    with inputs.opening(output):
        write_bytes(output, text.encode())
    if profiles is not None:
        from realizer_studio.analysis.recognise import recogniser

        if values is None:
            raise click.UsageError(
                "--profiles needs feature points of MPEG-4 among the markers; see --layout"
            )
        for part in recogniser(profiles).intervals(values, rate, measured, visible):
            click.echo(f"{part.start:8.2f} {part.end:8.2f} {part.emotion or '-'} {part.certainty:.2f}")


def _from_points(source: str, output: Path, fps: float) -> Tracked:
    import numpy as np

    from realizer.animation.fap.fap_clip import FAPClip
    from realizer.animation.frames import FAPFrames
    from realizer.outputs.fap_text import encode
    from realizer_studio.analysis.faps_from_points import bridge, faps_from_points, read_points

    inputs.check_suffix(output, ".fap")
    text = inputs.decode(inputs.read_file(source), source, "a table")
    with inputs.reporting(ValueError):
        moving, rest = read_points(text, source)
        values, observed = faps_from_points(bridge(moving), rest, _fapu(rest, source))
    times = np.arange(len(values)) / fps
    note(f"{output}: {len(values)} frames, {int(observed.sum())} FAPs")
    clip = FAPClip.of(FAPFrames(times, values, observed), fps, output.stem)
    return encode(clip), fps, values, observed, None


def _from_markers(
    source: Path, output: Path, fps: float | None, settings: MarkerSettings, face: str
) -> Tracked:
    from realizer_studio.tracking.markers.film import FORMATS, faps_of
    from realizer_studio.tracking.network import TrackingError

    inputs.check_suffix(output, *FORMATS)
    with inputs.reporting(TrackingError):
        markers = follow_markers(source, settings, fps)
        text = FORMATS[output.suffix.lower()](markers, face, output.stem)
        has_points = len([name for name in markers.layout.feature_points if name]) > 1
        faps, measured = faps_of(markers, face) if has_points else (None, None)
    found = f"{len(markers.layout)} markers, {markers.visible.mean():.1%} of them seen"
    note(f"{output}: {len(markers.points)} frames, {found}")
    return text, markers.fps, faps, measured, None


def _from_pictures(
    source: Path,
    output: Path,
    fps: float | None,
    *,
    face: str | None,
    neutral: str | None,
    person: int,
    **chosen: Any,
) -> Tracked:
    """Return what the face in pictures does, or what painted markers on it do."""
    from realizer_studio.tracking.files import FORMATS, by_mapping, mask
    from realizer_studio.tracking.follower import LandmarkCache
    from realizer_studio.tracking.network import TrackingError
    from realizer_studio.tracking.person_recording import rate_of, record

    with inputs.reporting(TrackingError):
        number = int(neutral) if neutral is not None and neutral.isdecimal() else None
        settings = marker_settings(source, chosen, number)
    if settings is not None:
        return _from_markers(source, output, fps, settings, face or "default")
    inputs.check_suffix(output, *FORMATS)
    with inputs.reporting(TrackingError):
        cache = LandmarkCache(output.with_name(f"{output.name}.part"), source) if source.is_file() else None
        times, people = follow(source, fps, cache)
        if person > len(people):
            raise click.BadParameter(f"there are {len(people)} people in {source}", param_hint="--person")
        subject = people[person - 1]
        rest = _neutral(neutral, subject) if neutral is not None else None
    recording = record(subject, times, fps or rate_of(times), rest)
    if face is not None:
        recording = by_mapping(recording, face)
    others = f"; {len(people)} people, this is --person {person}" if len(people) > 1 else ""
    note(f"{output}: {len(recording.times)} frames, the face is in {recording.visible.mean():.0%}{others}")
    text = FORMATS[output.suffix.lower()](recording, output.stem)
    if cache is not None:
        cache.remove()
    return text, recording.fps, recording.faps, mask(), recording.visible


def follow(
    source: Path, fps: float | None, cache: LandmarkCache | None = None
) -> tuple[list[float], list[Person]]:
    """Return the times of all pictures, and the people in them; cached pictures are skipped."""
    from realizer_studio.tracking.follower import follow
    from realizer_studio.tracking.network import TrackingError
    from realizer_studio.tracking.pictures import read_pictures

    count, pictures = read_pictures(source, fps or 25.0)
    with bar(pictures, count, "tracking", least=2) as shown:
        times, people = follow(shown, cache)
    if not people:
        raise TrackingError(
            f"{source}: wanted a face, found none in {len(times)} picture{'s' * (len(times) != 1)}; it must "
            "be seen from the front or a little from the side, and be a twentieth of the picture or larger"
        )
    return times, people


def _neutral(neutral: str, person: Person) -> Person:
    """Return the person at rest, from a picture of the film by its number, or from a file."""
    from realizer_studio.tracking.follower import Person

    if neutral.isdecimal():
        if int(neutral) not in person.frames:
            raise click.BadParameter(f"the face is not in picture {neutral}", param_hint="--neutral")
        return Person([0], [person.faces[person.frames.index(int(neutral))]])
    if not Path(neutral).is_file():
        raise click.BadParameter(
            f"wanted the number of a picture, or a file, got {neutral!r}", param_hint="--neutral"
        )
    return follow(Path(neutral), None)[1][0]


def _fapu(rest: dict[str, Float64], where: str) -> Fapu:
    import numpy as np

    from realizer.face.features import fapu_of

    try:
        with inputs.reporting(FaceError):
            return fapu_of({name: position.astype(np.float32) for name, position in rest.items()}, where)
    except KeyError as missing:
        raise click.UsageError(
            f"{where}: wanted point {missing.args[0]} in frame 0, to measure the face's proportions"
        ) from None
