"""`fap`: inspects, converts and plays FAP files."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import inputs, options
from realizer.cli.options import option
from realizer.cli.progress import note
from realizer.cli.realize import output_options, play_documents
from realizer.core.errors import RealizerError

if TYPE_CHECKING:
    from realizer.animation.fap.fap_clip import FAPClip

HOLD = 1.0  # s, the duration of a file with one frame
MAX_FPS = 240.0  # the highest --fps

file = click.argument("file", metavar="FILE", type=click.Path(exists=True, dir_okay=False, allow_dash=True))


@click.group()
def fap() -> None:
    """Inspect, convert and play FAP files (MPEG-4 facial animation parameters).

    FILE is a FAP text file of any program, or a .csv or .json file as written by `convert` and `realize`; -
    reads standard input. Irregularities of the file are reported on standard error and tolerated.
    """


@fap.command()
@file
@options.as_json
def info(file: str, as_json: bool) -> None:
    """Print the duration and frame rate of a file, and which FAPs it moves and how far."""
    from realizer.behaviours.fap_visemes import expand_compound
    from realizer.tables import faps

    clip = _read(file)
    moved = [row for row in faps()[2:] if clip.mask[row.fap - 1] and len(clip.values)]
    columns = {row.fap: clip.values[:, row.fap - 1] for row in moved}
    extremes = {number: (int(values.min()), int(values.max())) for number, values in columns.items()}
    seconds = round(max(len(clip.values) - 1, 0) / clip.fps, 6)
    compound = {
        "visemes": sorted({int(v) for v in clip.visemes[:, :2].flat if v}),
        "expressions": sorted({int(v) for v in clip.expressions[:, [0, 2]].flat if v}),
    }
    notes = expand_compound(clip).notes
    if as_json:
        data: dict[str, Any] = {
            "name": clip.name,
            "fps": clip.fps,
            "frames": len(clip.values),
            "duration": seconds,
            "faps": {
                row.name: dict(zip(("least", "most"), extremes[row.fap], strict=True)) | {"unit": row.unit}
                for row in moved
            },
            **compound,
            "notes": notes,
        }
        click.echo(json.dumps(data, ensure_ascii=False))
        return
    click.echo(f"{clip.name or '-'}: {len(clip.values)} frames at {clip.fps:g} fps, {seconds:g} s")
    for row in moved:
        least, most = extremes[row.fap]
        click.echo(f"{row.fap:>4} {row.name:<22} {least:>7} .. {most:<7} {row.unit}")
    for number, (name, values) in enumerate(compound.items(), 1):
        if clip.mask[number - 1]:
            click.echo(f"{number:>4} {name:<22} {', '.join(map(str, values)) or 'none'}")
    for text in notes:
        click.echo(f"{file}: {text}", err=True)


@fap.command()
@file
@option("-o --output OUT", "A .fap, .csv or .json file.", options.OUTPUT, required=True)
@option("--fps", "New frame rate.  [default: unchanged]", options.Number(0.1, 1000))
@option("--expand", "Replace visemes and expressions (FAPs 1 and 2) by low-level FAPs.", is_flag=True)
def convert(file: str, output: Path, fps: float | None, expand: bool) -> None:
    """Convert a file to another format or frame rate.

    A .fap file is written as the standard says: integers within their ranges, one mask, frames from 0.

    \b
    realizer fap convert greta.fap -o clean.fap --fps 30
    """
    from realizer.behaviours.fap_visemes import expand_compound
    from realizer.core.atomic_files import write_text
    from realizer_studio.cli.fap_clip_files import ENCODINGS, clip_to_range

    inputs.check_suffix(output, *ENCODINGS)
    suffix = output.suffix.lower()
    clip = _read(file)
    if expand:
        clip = expand_compound(clip)
    clip = clip if fps is None else clip.resampled(fps)
    if suffix == ".fap":
        clip = clip_to_range(clip)
    _print_notes(file, clip)
    with inputs.opening(output):
        write_text(output, ENCODINGS[suffix](replace(clip, name=clip.name or output.stem)))
    note(f"{output}: {len(clip.values)} frames at {clip.fps:g} fps")


@fap.command()
@file
@output_options
def play(file: str, **flags: Any) -> int:
    """Play a file on a face, to any format of `realizer outputs`.

    The file controls the FAPs it names, also those of visemes and expressions (FAPs 1 and 2); the rest of the
    face idles, unless --no-idle is given. The default frame rate is the file's. A single frame lasts 1 s.

    \b
    realizer fap play actor.fap -o actor.mp4 --face ben
    """
    import numpy as np

    from bml_schema.documents import MAX_BYTES
    from realizer.behaviours.fap_visemes import expand_compound
    from realizer.behaviours.keyframes import document_of

    clip = expand_compound(_read(file))
    _print_notes(file, clip)
    if len(clip.values) == 1:
        count = 1 + max(1, round(HOLD * clip.fps))
        values, visemes, expressions = (
            np.repeat(part, count, axis=0) for part in (clip.values, clip.visemes, clip.expressions)
        )
        clip = replace(clip, values=values, visemes=visemes, expressions=expressions)
    with inputs.reporting(RealizerError, f"{file}: ", click.ClickException):
        document = document_of(clip, "fap")
    room = MAX_BYTES * len(clip.values) // len(document)
    if room < len(clip.values):
        raise click.ClickException(
            f"{file}: wanted at most about {room} frames of these FAPs to play, got {len(clip.values)}; "
            "`realizer fap convert --fps` reduces them"
        )
    fps = flags["fps"] if flags["fps"] is not None else min(clip.fps, MAX_FPS)
    return play_documents(lambda: [document.encode()], flags | {"fps": fps})


def _read(file: str) -> FAPClip:
    from realizer_studio.cli.fap_clip_files import read_clip

    content = inputs.read_file(file)
    with inputs.reporting(RealizerError, f"{file}: ", click.ClickException):
        return read_clip(content)


def _print_notes(file: str, clip: FAPClip) -> None:
    for text in clip.notes:
        note(f"{file}: {text}")
