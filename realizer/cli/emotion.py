"""`emotion`: shows a word or a place on the emotion wheel, as FAPs and as a picture."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from realizer.cli import options

if TYPE_CHECKING:
    from realizer.emotions.profile import Profile

RINGS = (1.0, 3.0, 5.0, 7.0)  # activations of the picture of the wheel, as in Paul 2010, 6.4
WRITES = (".png", ".txt")


@click.command()
@click.argument("word", metavar="[WORD|FILE.txt]", required=False)
@click.option("--json", "as_json", is_flag=True, help="Print JSON: ranges, and the 68 values.")
@click.option(
    "--profiles",
    type=click.Choice(["own", "published", "raw"]),
    default="own",
    show_default=True,
    help="Ours; those of Raouzaiou et al. 2002, corrected; the same as printed.",
)
@click.option("--angle", type=float, metavar="DEGREES", help="Place on Paul's wheel; any turn.")
@click.option("--activation", type=float, help="0 the middle to 7 the rim.  [default: as full]")
@click.option("--valence", type=float, help="With --arousal, instead of an angle: -1 to 1.")
@click.option("--arousal", type=float, help="-1 to 1.")
@click.option("--seed", type=click.IntRange(0), help="Draw within the ranges instead of their middle.")
@click.option(
    "-o",
    "--output",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Picture (.png), or the profile as a line of Paul's file (.txt).",
)
@click.option(
    "--wheel",
    "chart",
    type=click.Path(path_type=Path),
    metavar="FILE.png",
    help="Draw the wheel: 16 angles, 4 activations.",
)
@click.option("--face", default="default", show_default=True, help="Whose face.")
@click.option("--camera", default="close", show_default=True, help=options.CAMERAS)
def emotion(
    word: str | None,
    as_json: bool,
    profiles: str,
    angle: float | None,
    activation: float | None,
    valence: float | None,
    arousal: float | None,
    seed: int | None,
    output: Path | None,
    chart: Path | None,
    face: str,
    camera: str,
) -> None:
    """Say which FAPs an emotion moves, and how far: of WORD, or of a place on the wheel.

    FILE.txt is a file of Paul's (2010, 6.3) with one profile, as -o writes it.

    \b
    realizer emotion guilty
    realizer emotion --angle 67.5 --activation 5 -o awe.png
    realizer emotion --valence -0.6 --arousal 0.4 --json
    realizer emotion --wheel wheel.png
    """
    for path, suffixes in ((output, WRITES), (chart, (".png",))):
        if path is not None and path.suffix.lower() not in suffixes:
            raise click.UsageError(f"{path}: wanted a name that ends in {' or '.join(suffixes)}")
    if output or chart:
        options.check_camera(face, camera)
    profile = _requested_profile(word, profiles, angle, activation, valence, arousal, bool(chart))
    if profile is not None:
        if output is not None:  # before it is told: who reads only the first lines gets the file too
            _write(profile, seed, output, face, camera)
        _print_profile(profile, _archetype_shares(profiles, angle, valence, arousal), seed, as_json)
    elif output is not None or as_json or seed is not None:
        raise click.UsageError("wanted a WORD, or a place, for what was asked; got only --wheel")
    if chart is not None:
        _draw_wheel(profiles, chart, face, camera)


def _requested_profile(
    word: str | None,
    profiles: str,
    angle: float | None,
    activation: float | None,
    valence: float | None,
    arousal: float | None,
    other: bool,
) -> Profile | None:
    from realizer.emotions.wheel import affect, wheel
    from realizer.emotions.words import emotion as profile_of

    if (valence is None) != (arousal is None):
        raise click.UsageError("wanted --valence and --arousal together, got one of them")
    if activation is not None and angle is None:
        raise click.UsageError("wanted --angle with --activation, got it alone")
    if (ways := sum(way is not None for way in (word, angle, valence))) > 1 or not (ways or other):
        raise click.UsageError("wanted one of WORD, --angle, or --valence with --arousal")
    try:
        if angle is not None:
            return wheel(angle, activation, profiles)
        if valence is not None and arousal is not None:
            return affect(valence, arousal, profiles)
        if word is not None and word.lower().endswith(".txt"):
            return _read(Path(word))
        return None if word is None else profile_of(word, profiles)
    except ValueError as error:
        raise click.UsageError(str(error)) from None


def _read(path: Path) -> Profile:
    """The profile of a file.

    Raises:
        ValueError: no such file, what is none of Paul's, or more than one profile.
    """
    from realizer.emotions.profile_file import read_profiles

    try:
        found = read_profiles(path.read_text("utf-8-sig"), str(path))
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: wanted a text in UTF-8, got: {error.reason} at {error.start}") from None
    except OSError as error:
        raise ValueError(f"{path}: wanted a file of one profile, got: {error.strerror}") from None
    if len(found) != 1:
        names = ", ".join(profile.name for profile in found[:5])
        raise ValueError(f"{path}: wanted one profile, got {len(found)}{names and ': ' + names}")
    return found[0]


def _archetype_shares(
    profiles: str, angle: float | None, valence: float | None, arousal: float | None
) -> Mapping[str, float]:
    """How much of which archetype is at a place; nothing of a word, whose name says what it is."""
    from realizer.emotions.wheel import blend_weights

    if angle is not None:
        return blend_weights(angle, profiles)
    if valence is not None and arousal is not None:
        return blend_weights(math.degrees(math.atan2(arousal, valence)), profiles, "affect")
    return {}


def _print_profile(profile: Profile, mixed: Mapping[str, float], seed: int | None, as_json: bool) -> None:
    from realizer.emotions.profile import Profile
    from realizer.tables import faps

    values = profile.frame() if seed is None else profile.draw(seed)
    names = {row.fap: row.name for row in faps()}
    if profile.ranges and not any(map(any, profile.ranges.values())):  # the middle of the wheel is no emotion
        profile, mixed = Profile("neutral", profile.source, {}), {}
    if as_json:
        ranges = {names[fap]: list(ends) for fap, ends in profile.ranges.items()}
        said = {"emotion": " and ".join(mixed) or profile.name, "profiles": profile.source, "ranges": ranges}
        if mixed:
            said["shares"] = {name: round(share, 4) for name, share in mixed.items()}
        click.echo(json.dumps(said | {"values": [round(float(value), 3) for value in values]}))
        return
    parts = " and ".join(f"{name} {share:.0%}" for name, share in mixed.items())
    click.echo(f"{parts or profile.name or 'neutral'} ({profile.source})")
    for fap, ends in profile.ranges.items():
        # + 0.0: no minus before a zero
        low, high, value = (round(float(number), 1) + 0.0 for number in (*ends, values[fap - 1]))
        click.echo(f"F{fap:<3} {names[fap]:<22} {low:8.1f} .. {high:7.1f}   {value:8.1f}")


def _write(profile: Profile, seed: int | None, path: Path, face: str, camera: str) -> None:
    from realizer.emotions.profile_file import write_profiles

    if path.suffix.lower() == ".txt":
        path.write_text(write_profiles([profile]), "utf-8")
        return
    from PIL import Image

    from realizer.render import Renderer

    pose = profile.frame() if seed is None else profile.draw(seed)
    with Renderer(face, (512, 512), camera) as renderer:
        Image.fromarray(renderer.draw(pose[None])[0]).save(path)


def _draw_wheel(profiles: str, path: Path, face: str, camera: str) -> None:
    """The faces of 16 angles (columns) and 4 activations (rows), labelled."""
    import numpy as np
    from PIL import Image

    from realizer.emotions.wheel import wheel
    from realizer.render import Renderer
    from realizer.render.contact_sheet import sheet
    from realizer.tables.wheel_words import ring

    places = [(place, activation) for activation in RINGS for place in ring("paul").values()]
    rows = np.stack([wheel(place.angle, activation, profiles).frame() for place, activation in places])
    with Renderer(face, (160, 160), camera) as renderer:
        pictures = renderer.draw(rows)
    titles = [f"{place.name} {place.angle:g}°" for place, _ in places]
    notes = [(f"activation {activation:g}",) for _, activation in places]
    columns = len(places) // len(RINGS)
    Image.fromarray(sheet(list(pictures), titles, notes, columns)).save(path)
    click.echo(f"{path}: {len(places)} faces", err=True)
