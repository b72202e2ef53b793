"""`batch`: realizes many documents, each once."""

from __future__ import annotations

import os
import sys
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import options
from realizer.cli.realize import PICTURES, performance_options

if TYPE_CHECKING:
    from realizer.batch.run import Workers
    from realizer.batch.task import Options

STATUS = ("done", "refused", "failed")


def _formats(context: click.Context, parameter: click.Parameter, value: tuple[str, ...]) -> tuple[str, ...]:
    """("fap", ".mp4") -> (".fap", ".mp4"), each once."""
    from realizer.outputs.registry import OUTPUTS

    suffixes = dict.fromkeys(f".{name.removeprefix('.').lower()}" for name in value)
    for suffix in suffixes:
        if suffix not in OUTPUTS:
            known = " ".join(known.removeprefix(".") for known in OUTPUTS)
            raise click.BadParameter(f"wanted one of {known}, got {suffix.removeprefix('.')}")
    return tuple(suffixes)


@click.command()
@click.argument("places", nargs=-1, required=True, metavar="IN...")
@click.option(
    "-o",
    "--output",
    "folder",
    required=True,
    metavar="DIR",
    type=click.Path(file_okay=False, path_type=Path),
    help="The folder of outputs and of manifest.jsonl.",
)
@click.option(
    "--format",
    "formats",
    multiple=True,
    required=True,
    metavar="NAME",
    callback=_formats,
    help="A suffix of `realizer outputs`; may be given several times.",
)
@click.option("--workers", type=click.IntRange(1, 1024), help="Processes here.  [default: one a core]")
@click.option("--dask", metavar="ADDRESS", help="Work on the machines of this Dask scheduler instead.")
@performance_options
@click.pass_context
def batch(
    context: click.Context,
    /,
    places: tuple[str, ...],
    folder: Path,
    formats: tuple[str, ...],
    workers: int | None,
    dask: str | None,
    **asked: Any,
) -> int:
    """Play many documents, each as `realize` would alone, to one file a format.

    IN is a document, a folder (all .bml and .xml in it), a pattern in quotes ('talks/**/*.bml'), or - for a
    list of these on standard input, one a line.

    What was played before with the same options, tables and program is not played again, so a batch that
    was interrupted goes on where it was. DIR/manifest.jsonl has a line for each document: what was written,
    warnings, or the error. A worker that dies is replaced and its document played again.
    """
    if dask is not None and workers is not None:
        raise click.UsageError("--workers, --dask: wanted one of them, got both")
    strict: bool = asked.pop("strict")
    how = _options(formats, asked)
    from realizer.batch.documents import DocumentsError, find
    from realizer.batch.run import batch as run

    try:
        documents = find(_listed(places))
    except DocumentsError as error:
        raise click.UsageError(str(error)) from None
    counts: Counter[str] = Counter()
    dropped = 0
    crew = _workers(how, min(workers or _cores(), len(documents)), dask)
    try:
        with click.progressbar(
            run(documents, folder, how, crew),
            length=len(documents),
            show_pos=True,
            file=sys.stderr,
            item_show_func=lambda item: None if item is None else item[0]["document"],
            hidden=context.obj["quiet"],
        ) as rows:
            for row, known in rows:
                counts[row["status"]] += 1
                counts["known"] += known
                dropped += bool(row.get("dropped"))
                if row["status"] == "failed":
                    click.echo(f"{row['document']}: {row['error']}", err=True)
    finally:
        crew.close()
    if not context.obj["quiet"]:
        parts = ", ".join(f"{counts[status]} {status}" for status in STATUS if counts[status])
        before = f" ({counts['known']} of them before)" if counts["known"] else ""
        click.echo(f"{folder}: {parts}{before}; manifest.jsonl says more", err=True)
    return 1 if counts["refused"] or counts["failed"] or (strict and dropped) else 0


def _options(formats: tuple[str, ...], asked: dict[str, Any]) -> Options:
    """How documents are played: flags, variables and defaults, and the voice that speaks by name."""
    from realizer.batch.task import Options
    from realizer.speech.registry import find_voice

    drawn = {name: asked[name] for name in ("light", "background")}
    chosen = options.play_settings(asked, **drawn)
    if any(suffix in PICTURES for suffix in formats):
        options.check_camera(chosen.face, asked["camera"])
    played = chosen.play_options(options.read_scene(chosen.scene))
    voice = find_voice(chosen.voice)
    voice.close()
    options.warn_no_voice(chosen.voice)
    return Options(
        **vars(played),
        formats=formats,
        voice=chosen.voice or voice.name,
        size=asked["size"],
        camera=asked["camera"],
        light=chosen.light,
        background=chosen.background,
    )


def _listed(places: tuple[str, ...]) -> list[str]:
    """The places, with those of standard input where `-` stands."""
    named: list[str] = []
    for place in places:
        named += [line for line in sys.stdin.read().splitlines() if line.strip()] if place == "-" else [place]
    return named


def _workers(how: Options, workers: int, dask: str | None) -> Workers:
    if dask is not None:
        from realizer.batch.dask_cluster import DaskCluster

        return DaskCluster(how, dask)
    from realizer.batch.process_pool import ProcessPool

    return ProcessPool(how, workers)


def _cores() -> int:
    """How many of the machine's cores are ours."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
