"""`realize` and `schedule`: play documents offline."""

from __future__ import annotations

import errno
import json
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import options
from realizer.core.options import PlayOptions

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable

    from realizer.charts.timeline import BlockChart
    from realizer.playback.player import Player
    from realizer.scheduling.timing import Schedule

PICTURES = (".png", ".webp", ".mp4", ".webm")
TRANSPARENT = "transparent"
DRAWN = ("size", "camera", "at", "light", "background", "visemes")  # fields of Drawing
# What the machine lacks, whatever was asked for: room.
FULL = (errno.ENOSPC, errno.EFBIG)


def performance_options(command: options.Command) -> options.Command:
    """What can be asked of any performance: how documents are played, and how they are drawn."""
    for option in (
        options.playback_options,
        options.mapping,
        options.cooccurrence,
        options.prosody,
        click.option("--no-idle", is_flag=True, help="No blinks, no small head motion."),
        click.option("--seed", type=int, help="Of idle motion: the same seed, the same bytes.  [default: 0]"),
        options.background,
        options.light,
        click.option("--camera", default="front", show_default=True, help=options.CAMERAS),
        click.option(
            "--size", default="512x512", show_default=True, callback=options.size, help="Of pictures."
        ),
        options.deformer,
        click.option("--face", metavar="NAME", help="A face of `realizer faces list`."),
        click.option(
            "--fps", type=options.Number(0, 240, min_open=True), help="Frames a second.  [default: 25]"
        ),
    ):
        command = option(command)
    return command


def output_options(command: options.Command) -> options.Command:
    """What can be asked of a performance that is written to a file."""
    for option in (
        performance_options,
        click.option(
            "--visemes", is_flag=True, help="With .fap: FAP 1 too, the two visemes that are said most."
        ),
        click.option(
            "--at",
            type=options.Number(0),
            metavar="SECONDS",
            help="With .png: the picture of that instant.",
        ),
        click.option(
            "-o",
            "--output",
            metavar="OUT",
            help="Where to; its suffix picks the encoding. Default: JSON here.",
        ),
    ):
        command = option(command)
    return command


@click.command()
@options.documents
@output_options
@click.pass_context
def realize(context: click.Context, /, documents: tuple[str, ...], **asked: Any) -> int:
    """Play documents offline and write frames, pictures, sound or film.

    Several documents are submitted at 0 s in order; their composition attributes apply.
    """
    return play_documents(context, lambda: options.read_documents(documents), asked)


def play_documents(context: click.Context, read: Callable[[], list[bytes]], asked: dict[str, Any]) -> int:
    """Play the documents that `read` gives, as the options of `output_options` ask; returns the exit status.

    They are read when all that was asked has been found possible.

    Args:
        asked: the options by their names.
    """
    from realizer.outputs.output import RenderSettings
    from realizer.outputs.registry import output_for

    output, strict = asked["output"], asked["strict"]
    writer = None
    if output not in (None, "-"):
        try:
            writer = output_for(Path(output))
        except ValueError as error:
            raise click.BadParameter(str(error), param_hint="-o") from None
    chosen = options.play_settings(asked)
    drawing = RenderSettings(**{name: asked[name] for name in DRAWN})
    if writer is not None and writer.suffix in PICTURES:
        options.check_camera(chosen.face, drawing.camera)
    one = writer is not None and writer.suffix == ".png" and drawing.at is not None
    if drawing.background == TRANSPARENT and not one:
        raise click.BadParameter(
            "wanted a colour such as #d8dde2: only the picture of one instant, a .png with --at, "
            "can be transparent",
            param_hint="--background",
        )
    if drawing.visemes and (writer is None or writer.suffix != ".fap"):
        raise click.BadParameter("wanted a .fap file to write FAP 1 into", param_hint="--visemes")
    texts = read()
    if writer is not None:
        drawing = writer.begin(drawing, chosen.face, chosen.deformer)
    # What planning needs is imported while the drawing process gets ready.
    from realizer.pipeline import play

    realization = play(texts, chosen.play_options(options.read_scene(chosen.scene)), chosen.voice)
    if any(speaking.utterance.pcm is None for speaking in realization.speeches):
        options.warn_no_voice(chosen.voice)
    options.print_warnings(realization.warnings)
    if writer is None:
        json.dump(realization.to_json(), sys.stdout)
        sys.stdout.write("\n")
        sys.stdout.flush()
    elif output is not None:
        if not realization.has_content:
            click.echo(f"{output}: not written, as there is nothing to play", err=True)
            return 1
        try:
            writer.write(realization, Path(output), drawing)
        except OSError as error:
            if error.errno in FULL:
                raise
            raise click.UsageError(f"{output}: {error.strerror or error}") from None
        first, *others = (name or "the unnamed character" for name in realization.characters)
        if others and not writer.all_characters:
            left = ", ".join(others)
            words = f"{output}: shows {first}, not {left}: it has room for the face of one character"
            click.echo(words, err=True)
        if not context.obj["quiet"]:
            words = (
                f"{output}: {realization.duration:.2f} s, {realization.frames} frames at {chosen.fps:g} fps"
            )
            click.echo(words, err=True)
    return 1 if realization.refusals or (strict and any(s.dropped for s in realization.schedules)) else 0


@click.command()
@options.documents
@click.option("--json", "as_json", is_flag=True, help="As JSON instead of a table.")
@click.option("--bml", "as_bml", is_flag=True, help="As the documents themselves, with all times as numbers.")
@click.option("--detail", is_flag=True, help="With --json: gaps, what ties them, and what was dropped, too.")
@click.option("-o", "--output", metavar="FILE", help="Where to, instead of here.")
@click.option("--plot", metavar="FILE", help="Draw the timeline, as .svg or .png, instead of a table.")
@options.playback_options
def schedule(
    documents: tuple[str, ...],
    as_json: bool,
    as_bml: bool,
    detail: bool,
    output: str | None,
    plot: str | None,
    voice: str | None,
    scene: str | None,
    media: Path | None,
    expressions: Path | None,
    strict: bool,
) -> int:
    """Print when every sync point falls, in seconds from block start.

    With --bml every document comes back with these times, what was dropped left out; scheduling it again
    gives the same times.

    A plot has a row for each behaviour: its sync points, its gaps coloured by how far they are from the
    length they would like, what ties them, how much room before and after leave, and what was dropped.
    """
    from realizer.pipeline import plan
    from realizer.playback.player import Player

    if as_json and as_bml:
        raise click.UsageError("--json, --bml: wanted one of them, got both")
    if detail and not as_json:
        raise click.UsageError("--detail: wanted --json too")
    if plot is not None:
        _check_plot(plot)
    chosen = options.settings(voice=voice, scene=scene, media=media, expressions=expressions)
    player = Player(
        PlayOptions(
            scene=options.read_scene(chosen.scene),
            idle=False,
            language=chosen.language,
            media=chosen.media,
            expressions=chosen.expressions,
        )
    )
    texts = options.read_documents(documents)
    accepted, refused = plan(texts, player, chosen.voice)
    schedules = [_final_schedule(player, planned) for planned in accepted]
    if any(speaking.utterance.pcm is None for speaking in player.speech()):
        options.warn_no_voice(chosen.voice)
    options.print_warnings(w for w in refused if not any(w in s.warnings for s in schedules))
    for planned in schedules:
        options.print_warnings(planned.warnings)
    if as_bml:
        words = _as_documents(texts, schedules)
    elif as_json:
        out: Any = [s.to_json() for s in schedules]
        if detail:
            out = [told | line.detail() for told, line in zip(out, _charts(player, accepted), strict=True)]
        words = json.dumps(out[0] if len(out) == 1 and len(documents) == 1 else out, indent=1) + "\n"
    else:
        words = "" if plot is not None else "".join(_table(planned) for planned in schedules)
    if plot is not None:
        _plot(player, accepted, plot)
    if output in (None, "-"):
        click.echo(words, nl=False)
    elif output is not None:
        try:
            Path(output).write_text(words, "utf-8")
        except OSError as error:
            raise click.UsageError(f"{output}: {error.strerror or error}") from None
    return 1 if refused or (strict and any(s.dropped for s in schedules)) else 0


def _final_schedule(player: Player, planned: Schedule) -> Schedule:
    """The schedule as later documents moved it; as it was planned where they ended it before its time."""
    latest = player.latest(planned)
    return latest if latest.times.keys() == planned.times.keys() else planned


def _check_plot(plot: str) -> None:
    """Before anything is planned."""
    from realizer.charts.write_chart import writer_for

    try:
        writer_for(plot)
    except ValueError as error:
        raise click.BadParameter(str(error), param_hint="--plot") from None


def _plot(player: Player, accepted: list[Schedule], plot: str) -> None:
    from realizer.charts.write_chart import write_timeline

    try:
        write_timeline(_charts(player, accepted), plot)
    except OSError as error:
        raise click.UsageError(f"{plot}: {error.strerror or error}") from None


def _charts(player: Player, accepted: list[Schedule]) -> list[BlockChart]:
    """The blocks of these schedules as charts and their data show them."""
    from realizer.charts.chart_data import charts_of

    return charts_of(player.blocks, accepted)


def _table(planned: Schedule) -> str:
    """A line for the block, and one for each behaviour."""
    if planned.failed:
        return f"{planned.block}  refused\n"
    lines = [f"{planned.block}  {planned.start:.3f} .. {planned.end:.3f} s"]
    width = max((len(b) for b in planned.times), default=0)
    for behaviour, times in planned.behaviours.items():
        points = "  ".join(f"{name} {time:.3f}" for name, time in times.items())
        lines.append(f"  {behaviour:<{width}}  {points}")
    return "\n".join(lines) + "\n"


def _as_documents(texts: Iterable[bytes], schedules: Iterable[Schedule]) -> str:
    """The documents of texts with the times of their schedules, one of each, in order."""
    from bml_schema import Block, read, with_absolute_times, write
    from realizer.behaviours.registry import VOCABULARY

    blocks = [item for text in texts for item in read(text, VOCABULARY) if isinstance(item, Block)]
    pairs = zip(blocks, schedules, strict=True)
    return "".join(
        write(with_absolute_times(block, planned.behaviours))
        for block, planned in pairs
        if not planned.failed
    )
