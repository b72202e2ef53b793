"""`fap`: inspects, converts and plays FAP files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import options
from realizer.cli.realize import output_options, play_documents

if TYPE_CHECKING:
    from realizer.animation.fap.fap_clip import FAPClip

HELD = 1.0  # s; how long a file of one frame is played
FASTEST = 240.0  # frames a second that can be asked of a performance

file = click.argument("file", metavar="FILE", type=click.Path(exists=True, dir_okay=False, allow_dash=True))


@click.group()
def fap() -> None:
    """Look into FAP files, convert and play them.

    FILE is MPEG-4 FAP text as any program writes it, or a .csv or .json of frames as `convert` and `realize`
    write them; - is standard input. What is odd in it is said on standard error, and survived.
    """


@fap.command()
@file
@click.option("--json", "as_json", is_flag=True, help="As JSON instead of lines.")
def info(file: str, as_json: bool) -> None:
    """Say how long a file is, at what rate, what it moves and how far."""
    from realizer.behaviours.fap_visemes import expand_compound
    from realizer.tables import faps

    clip = _read(file)
    given = [row for row in faps()[2:] if clip.mask[row.fap - 1] and len(clip.values)]
    columns = {row.fap: clip.values[:, row.fap - 1] for row in given}
    extremes = {number: (int(values.min()), int(values.max())) for number, values in columns.items()}
    seconds = round(max(len(clip.values) - 1, 0) / clip.fps, 6)
    compound = {
        "visemes": sorted({int(v) for v in clip.visemes[:, :2].flat if v}),
        "expressions": sorted({int(v) for v in clip.expressions[:, [0, 2]].flat if v}),
    }
    notes = expand_compound(clip).notes
    if as_json:
        moved = {
            row.name: dict(zip(("least", "most"), extremes[row.fap], strict=True)) | {"unit": row.unit}
            for row in given
        }
        told = {"name": clip.name, "fps": clip.fps, "frames": len(clip.values), "duration": seconds}
        click.echo(json.dumps(told | {"faps": moved} | compound | {"notes": notes}, ensure_ascii=False))
        return
    click.echo(f"{clip.name or '-'}: {len(clip.values)} frames at {clip.fps:g} fps, {seconds:g} s")
    for row in given:
        least, most = extremes[row.fap]
        click.echo(f"{row.fap:>4} {row.name:<22} {least:>7} .. {most:<7} {row.unit}")
    for number, (what, found) in enumerate(compound.items(), 1):
        if clip.mask[number - 1]:
            click.echo(f"{number:>4} {what:<22} {', '.join(map(str, found)) or 'none'}")
    for note in notes:
        click.echo(f"{file}: {note}", err=True)


@fap.command()
@file
@click.option("-o", "--output", metavar="OUT", required=True, help="Where to: a .fap, .csv or .json file.")
@click.option("--fps", type=options.Number(0.1, 1000), help="Frames a second.  [default: as they are]")
@click.option(
    "--expand", is_flag=True, help="Write what visemes and expressions (FAP 1, 2) show as other FAPs."
)
@click.pass_context
def convert(context: click.Context, file: str, output: str, fps: float | None, expand: bool) -> None:
    """Write the frames of a file as another one, at another rate too.

    A .fap is as the standard has it: whole numbers within their ranges, one mask, frames from 0.

    \b
    realizer fap convert greta.fap -o clean.fap --fps 30
    """
    from realizer.behaviours.fap_visemes import expand_compound
    from realizer.core.atomic_files import write_text
    from realizer.outputs.fap_clip_files import ENCODINGS, clip_to_range

    suffix = Path(output).suffix.lower()
    if suffix not in ENCODINGS:
        raise click.BadParameter(
            f"{output}: wanted a suffix of {' '.join(ENCODINGS)}, got {suffix or 'none'}", param_hint="-o"
        )
    clip = _read(file)
    if expand:
        clip = expand_compound(clip)
    clip = clip if fps is None else clip.resampled(fps)
    if suffix == ".fap":
        clip = clip_to_range(clip)
    _print_info(context, file, clip)
    name = clip.name or Path(output).stem
    try:
        write_text(Path(output), ENCODINGS[suffix](replace(clip, name=name)))
    except OSError as error:
        raise click.UsageError(f"{output}: {error.strerror or error}") from None
    if not context.obj["quiet"]:
        click.echo(f"{output}: {len(clip.values)} frames at {clip.fps:g} fps", err=True)


@fap.command()
@file
@output_options
@click.pass_context
def play(context: click.Context, /, file: str, **asked: Any) -> int:
    """Play a file into any output of `realizer outputs`, visemes and expressions (FAP 1, 2) too.

    Its FAPs stand in place of what else moves them; the rest of the face idles, unless there is --no-idle.
    The rate is the file's own. A file of one frame is held for a second.

    \b
    realizer fap play actor.fap -o actor.mp4 --face ben
    """
    import numpy as np

    from bml_schema.documents import MAX_BYTES
    from realizer.behaviours.fap_document import document_of
    from realizer.behaviours.fap_visemes import expand_compound
    from realizer.core.errors import RealizerError

    clip = expand_compound(_read(file))
    _print_info(context, file, clip)
    if len(clip.values) == 1:
        count = 1 + max(1, round(HELD * clip.fps))
        values, visemes, expressions = (
            np.repeat(part, count, axis=0) for part in (clip.values, clip.visemes, clip.expressions)
        )
        clip = replace(clip, values=values, visemes=visemes, expressions=expressions)
    try:
        document = document_of(clip, "fap")
    except RealizerError as error:
        raise _refused(file, error) from None
    room = MAX_BYTES * len(clip.values) // len(document)
    if room < len(clip.values):
        raise click.ClickException(
            f"{file}: wanted at most about {room} frames of these FAPs to play, got {len(clip.values)}; "
            "`realizer fap convert --fps` makes fewer of them"
        )
    fps = asked["fps"] if asked["fps"] is not None else min(clip.fps, FASTEST)
    return play_documents(context, lambda: [document.encode()], asked | {"fps": fps})


def _read(file: str) -> FAPClip:
    from realizer.core.errors import RealizerError
    from realizer.outputs.fap_clip_files import read_clip

    (content,) = options.read_documents([file])
    try:
        return read_clip(content)
    except RealizerError as error:
        raise _refused(file, error) from None


def _print_info(context: click.Context, file: str, clip: FAPClip) -> None:
    if not context.obj["quiet"]:
        for note in clip.notes:
            click.echo(f"{file}: {note}", err=True)


def _refused(file: str, error: Exception) -> click.ClickException:
    """Exit status 1, as for a document."""
    return click.ClickException(f"{file}: {error}")
