"""`emotion`: prints or draws the FAPs of an emotion word or of a place on the emotion wheel."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import inputs, options
from realizer.cli.options import option
from realizer.cli.progress import note

if TYPE_CHECKING:
    from realizer.emotions.profile import Profile

RINGS = (1.0, 3.0, 5.0, 7.0)  # activations in the picture of the wheel, as in Paul 2010, 6.4


@click.command()
@click.argument(
    "word",
    metavar="[WORD|FILE.txt]",
    required=False,
    shell_complete=options.completing("realizer.emotions.words:known_words"),
)
@option("--json", "Print JSON: the ranges and all 68 values.", name="as_json", is_flag=True)
@option(
    "--profiles",
    "Profiles: own, those of Raouzaiou et al. 2002, corrected (published) or as printed (raw), or of a "
    'file. "published, fear 3" has fear 3 stand for fear.',
    options.ProfileSet(),
    default="own",
)
@option("--angle DEGREES", "Angle on the wheel of Paul 2010.", float)
@option("--activation", "With --angle: 0 (neutral) to 7 (full).  [default: full]", float)
@option("--valence", "Unpleasant (-1) to pleasant (1); needs --arousal.", float)
@option("--arousal", "Calm (-1) to excited (1); needs --valence.", float)
@option("--seed", "Choose random values instead of the middle values.", click.IntRange(0))
@option(
    "-o --output FILE", "Write a picture (.png) or a profile file of Paul 2010, 6.3 (.txt).", options.OUTPUT
)
@option("--wheel FILE.png", "Draw the whole wheel: 16 angles at 4 activations.", options.OUTPUT, name="chart")
@options.face("Face to draw", default="default", show_default=True)
@option("--camera", options.CAMERAS, default="close", shell_complete=options.completing_cameras)
def emotion(output: Path | None, chart: Path | None, face: str, camera: str, **how: Any) -> None:
    """Print which FAPs an emotion moves, and how far.

    The emotion is a WORD, a place on the emotion wheel (--angle), a degree of valence and arousal, or each
    profile in FILE.txt, as written by -o.

    \b
    realizer emotion guilty
    realizer emotion --angle 67.5 --activation 5 -o awe.png
    realizer emotion --valence -0.6 --arousal 0.4 --json
    realizer emotion --wheel wheel.png
    """
    inputs.check_suffix(output, ".png", ".txt")
    inputs.check_suffix(chart, ".png")
    if output or chart:
        options.check_camera(face, camera)
    found, shares = _requested_profiles(how, bool(chart))
    seed, as_json = how["seed"], how["as_json"]
    if found:
        if output is not None:  # before anything is printed: the reader may close the pipe
            _write(found, seed, output, face, camera)
        for profile in found:
            _print_profile(profile, shares, seed, as_json)
    elif output is not None or as_json or seed is not None:
        raise click.UsageError("wanted a WORD or a place for --json, --seed and -o; got only --wheel")
    if chart is not None:
        _draw_wheel(how["profiles"], chart, face, camera)


def _requested_profiles(
    how: dict[str, Any], wheel_only: bool
) -> tuple[tuple[Profile, ...], Mapping[str, float]]:
    """Return the profiles of the options, none if only the wheel was requested; and archetype -> share."""
    from realizer.emotions.archetypes import is_profile_file, read_profile_file
    from realizer.emotions.chosen import emotion_and_shares

    word, *place = (how[name] for name in ("word", "angle", "activation", "valence", "arousal"))
    angle, activation, valence, arousal = place
    if wheel_only and all(option is None for option in (word, *place)):
        return (), {}
    with inputs.reporting(ValueError):
        if word is not None and is_profile_file(word) and angle is None and valence is None:
            return read_profile_file(Path(word)), {}
        profile, shares = emotion_and_shares(word, angle, activation, (valence, arousal), how["profiles"])
        return (profile,), shares


def _print_profile(profile: Profile, shares: Mapping[str, float], seed: int | None, as_json: bool) -> None:
    from realizer.emotions.profile import Profile
    from realizer.tables import faps

    values = profile.frame() if seed is None else profile.draw(seed)
    names = {row.fap: row.name for row in faps()}
    if profile.ranges and not any(map(any, profile.ranges.values())):  # the middle of the wheel
        profile, shares = Profile("neutral", profile.source, {}), {}
    if as_json:
        ranges = {names[fap]: list(ends) for fap, ends in profile.ranges.items()}
        data = {"emotion": " and ".join(shares) or profile.name, "profiles": profile.source, "ranges": ranges}
        if shares:
            data["shares"] = {name: round(share, 4) for name, share in shares.items()}
        click.echo(json.dumps(data | {"values": [round(float(value), 3) for value in values]}))
        return
    parts = " and ".join(f"{name} {share:.0%}" for name, share in shares.items())
    click.echo(f"{parts or profile.name or 'neutral'} ({profile.source})")
    for fap, ends in profile.ranges.items():
        # + 0.0 turns -0.0 into 0.0.
        low, high, value = (round(float(number), 1) + 0.0 for number in (*ends, values[fap - 1]))
        click.echo(f"F{fap:<3} {names[fap]:<22} {low:8.1f} .. {high:7.1f}   {value:8.1f}")


def _write(profiles: Sequence[Profile], seed: int | None, path: Path, face: str, camera: str) -> None:
    from realizer.emotions.profile import write_profiles

    if path.suffix.lower() == ".txt":
        path.write_text(write_profiles(profiles), "utf-8")
        return
    import numpy as np
    from PIL import Image

    from realizer.render.contact_sheet import sheet
    from realizer.render.renderer import Renderer

    poses = np.stack([profile.frame() if seed is None else profile.draw(seed) for profile in profiles])
    with Renderer(face, (512, 512), camera) as renderer:
        pictures = list(renderer.draw(poses))
    titles, notes = [profile.name for profile in profiles], [()] * len(profiles)
    whole = pictures[0] if len(pictures) == 1 else sheet(pictures, titles, notes, min(len(pictures), 4))
    Image.fromarray(whole).save(path)


def _draw_wheel(profiles: str, path: Path, face: str, camera: str) -> None:
    """Draw the labelled faces of 16 angles (columns) and 4 activations (rows)."""
    import numpy as np
    from PIL import Image

    from realizer.emotions.wheel import wheel
    from realizer.render.contact_sheet import sheet
    from realizer.render.renderer import Renderer
    from realizer.tables.emotions import ring

    places = [(place, activation) for activation in RINGS for place in ring("paul").values()]
    rows = np.stack([wheel(place.angle, activation, profiles).frame() for place, activation in places])
    with Renderer(face, (160, 160), camera) as renderer:
        pictures = renderer.draw(rows)
    titles = [f"{place.name} {place.angle:g}°" for place, _ in places]
    notes = [(f"activation {activation:g}",) for _, activation in places]
    columns = len(places) // len(RINGS)
    Image.fromarray(sheet(list(pictures), titles, notes, columns)).save(path)
    note(f"{path}: {len(places)} faces")
