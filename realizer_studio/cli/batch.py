"""`batch`: realizes many documents in parallel."""

from __future__ import annotations

import os
import sys
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import inputs, options
from realizer.cli.options import option
from realizer.cli.progress import bar, note, warn_no_voice
from realizer.cli.realize import PICTURES, performance_options

if TYPE_CHECKING:
    from realizer_studio.batch.dask_cluster import DaskCluster
    from realizer_studio.batch.process_pool import ProcessPool
    from realizer_studio.batch.task import Options

STATUS = ("done", "refused", "failed")


def _formats(context: click.Context, parameter: click.Parameter, value: tuple[str, ...]) -> tuple[str, ...]:
    """Return the suffixes of formats that are given with or without their dot, each once."""
    from realizer.outputs.registry import OUTPUTS

    suffixes = dict.fromkeys(f".{name.removeprefix('.').lower()}" for name in value)
    for suffix in suffixes:
        if suffix not in OUTPUTS:
            known = " ".join(known.removeprefix(".") for known in OUTPUTS)
            raise click.BadParameter(f"wanted one of {known}, got {suffix.removeprefix('.')}")
    return tuple(suffixes)


@click.command()
@click.argument("places", nargs=-1, required=True, metavar="IN...")
@option(
    "-o --output DIR",
    "Folder for the outputs and manifest.jsonl.",
    click.Path(file_okay=False, path_type=Path),
    name="folder",
    required=True,
)
@option(
    "--format NAME",
    "Format to write, a suffix of `realizer outputs`; repeat it for several.",
    name="formats",
    multiple=True,
    required=True,
    callback=_formats,
    shell_complete=options.completing("realizer.outputs.registry:OUTPUTS"),
)
@option("--workers", "Number of processes.  [default: one per core]", click.IntRange(1, 1024))
@option("--dask ADDRESS", "Run on the workers of this Dask scheduler instead.")
@performance_options
def batch(
    places: tuple[str, ...],
    folder: Path,
    formats: tuple[str, ...],
    workers: int | None,
    dask: str | None,
    **flags: Any,
) -> int:
    """Realize many documents, each on its own, in parallel.

    IN is a document, a folder (all .bml and .xml files in it), a quoted pattern, or - for a list of these on
    standard input, one a line.

    \b
    realizer batch talks/ -o films/ --format mp4
    realizer batch 'talks/**/*.bml' -o out/ --format fap --format wav --workers 4

    Run the same command again to continue an interrupted batch: documents already realized with the same
    options, tables and version are skipped. DIR/manifest.jsonl has one line per document with the files
    written, the warnings or the error. A worker that crashes is replaced and its document tried again.
    """
    if dask is not None and workers is not None:
        raise click.UsageError("--workers, --dask: wanted one of them, got both")
    strict: bool = flags.pop("strict")
    how = _options(formats, flags)
    from realizer.outputs.registry import OUTPUTS
    from realizer_studio.batch.run import DocumentsError, find
    from realizer_studio.batch.run import batch as run

    with inputs.reporting(DocumentsError):
        lines = (list(filter(str.strip, sys.stdin.read().splitlines())) if p == "-" else [p] for p in places)
        documents = find(place for listed in lines for place in listed)
    single = [suffix for suffix in formats if not OUTPUTS[suffix].all_characters]
    counts: Counter[str] = Counter()
    dropped = 0
    pool = _workers(how, min(workers or _core_count(), len(documents)), dask)
    try:
        with bar(
            run(documents, folder, how, pool),
            len(documents),
            show_pos=True,
            item_show_func=lambda item: None if item is None else item[0]["document"],
        ) as rows:
            for row, known in rows:
                counts[row["status"]] += 1
                counts["known"] += known
                dropped += bool(row.get("dropped"))
                if row["status"] == "failed":
                    click.echo(f"{row['document']}: {row['error']}", err=True)
                elif row["status"] == "refused":
                    reason = next((w["text"] for w in row["warnings"]), "nothing to play")
                    click.echo(f"{row['document']}: refused: {reason}", err=True)
                first, *others = row.get("characters", [""])
                if others and single:
                    shows = f"{', '.join(single)} show {first}, not {', '.join(others)}"
                    click.echo(f"{row['document']}: {shows}; see realize --character", err=True)
    finally:
        pool.close()
    parts = ", ".join(f"{counts[status]} {status}" for status in STATUS if counts[status])
    before = f" ({counts['known']} of them before)" if counts["known"] else ""
    note(f"{folder}: {parts}{before}; see manifest.jsonl for details")
    return 1 if counts["refused"] or counts["failed"] or (strict and dropped) else 0


def _options(formats: tuple[str, ...], flags: dict[str, Any]) -> Options:
    """Return the options of the batch; fails if the voice is not installed."""
    from realizer.speech.registry import find_voice
    from realizer_studio.batch.task import Options

    chosen = inputs.play_settings(flags, light=flags["light"], background=flags["background"])
    if any(suffix in PICTURES for suffix in formats):
        options.check_camera(chosen.face, flags["camera"])
    play = chosen.play_options(inputs.read_scene(chosen.scene))
    voice = find_voice(chosen.voice)
    voice.close()
    warn_no_voice(chosen.voice)
    return Options(
        **vars(play),
        formats=formats,
        voice=chosen.voice or voice.name,
        size=flags["size"],
        camera=flags["camera"],
        light=chosen.light,
        background=chosen.background,
    )


def _workers(how: Options, workers: int, dask: str | None) -> ProcessPool | DaskCluster:
    if dask is not None:
        from realizer_studio.batch.dask_cluster import DaskCluster

        return DaskCluster(how, dask)
    from realizer_studio.batch.process_pool import ProcessPool

    return ProcessPool(how, workers)


def _core_count() -> int:
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
