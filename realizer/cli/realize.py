"""`realize` and `schedule`: play documents offline."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import partial
from math import inf
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import inputs, options
from realizer.cli.options import option
from realizer.cli.progress import note, print_warnings, steps, warn_no_voice

if TYPE_CHECKING:
    from realizer.outputs.output import Output, RenderSettings
    from realizer.realization import Realization
    from realizer.scheduling.timing import Schedule

PICTURES = (".png", ".webp", ".mp4", ".webm")
# Fields of RenderSettings.
LOOK = ("size", "camera", "light", "background")
DRAWN = (*LOOK, "at", "morphs", "visemes", "avatar")

performance_options = options.several(
    options.fps,
    options.face("Face to animate"),
    options.deformer,
    options.size,
    options.camera,
    options.light,
    options.background,
    option("--seed", "Seed of idle motion: equal seeds give equal files.  [default: 0]", int),
    option("--no-idle", "No blinks or small head motion of an idle face.", is_flag=True),
    options.motion_options,
    options.playback_options,
)
output_options = options.several(
    option(
        "-o --output OUT",
        "File to write, in the format of its suffix; see `realizer outputs`.  [default: print JSON]",
    ),
    options.at,
    option("--character ID", "Character to show, in formats that hold one.  [default: the first]"),
    option(
        "--morphs",
        "With .glb: morph targets that show each frame exactly, or ARKit's 52 shapes.",
        click.Choice(["fap", "arkit"]),
        default="fap",
    ),
    option(
        "--avatar GLB",
        "With .glb: animate this .glb or .vrm file, which has ARKit's shapes, instead of the face.",
        click.Path(exists=True, dir_okay=False),
    ),
    option("--visemes", "With .fap: also write the visemes (FAP 1).", is_flag=True),
    performance_options,
)


@click.command()
@options.documents
@option(
    "--plain",
    "Speak a TEXT sign by sign, without Markdown, stage directions and the like.",
    is_flag=True,
)
@output_options
def realize(documents: tuple[str, ...], plain: bool, **flags: Any) -> int:
    """Play documents without a clock, to a film, picture, sound or animation data.

    \b
    realizer realize "Hello there" -o hello.mp4
    realizer realize hello.bml -o hello.png --at 1.5 --camera profile
    realizer realize one.bml two.bml -o talk.fap --seed 7
    realizer realize recording.wav -o recording.mp4

    Several documents are submitted at 0 s, in order; their composition attributes apply. A TEXT is spoken:
    anything that begins no document, names no file and is no single word with a path separator or the end
    of one. Markdown, SSML, stage directions and numbers in it are read as people mean them. The lips follow
    a recording.
    """
    read = partial(inputs.read_documents, documents, flags["language"], plain=plain)
    return play_documents(read, flags, documents)


def play_documents(
    read: Callable[[], list[str | bytes]], flags: dict[str, Any], names: Sequence[str] = ()
) -> int:
    """Play documents with the options of `output_options` and return the exit status.

    Args:
        read: returns the documents; it is called after the options have been checked.
        flags: the options by name.
        names: of the documents, in whose folder they find their files.
    """
    from realizer.outputs.output import RenderSettings
    from realizer.outputs.registry import OUTPUTS

    writer = writer_for(flags["output"])
    chosen = inputs.play_settings(flags, names)
    drawing = RenderSettings(**{name: flags[name] for name in DRAWN})
    if writer is not None and writer.suffix in PICTURES:
        options.check_camera(chosen.face, drawing.camera)
    with inputs.reporting(ValueError, "--"):
        (writer or OUTPUTS[".json"]).check(drawing)
    if writer is not None and writer.picture_size is None:
        usual = RenderSettings()
        if idle := [f"--{name}" for name in LOOK if getattr(drawing, name) != getattr(usual, name)]:
            click.echo(f"{writer.suffix} has no pictures: {', '.join(idle)} changes nothing", err=True)
    texts = read()
    if writer is not None:
        drawing = writer.begin(drawing, chosen.face, chosen.deformer)
    # The planner is imported while the drawing process starts.
    from realizer.pipeline import play

    realization = play(texts, chosen.play_options(inputs.read_scene(chosen.scene)), chosen.voice)
    if any(speaking.utterance.pcm is None for speaking in realization.speeches):
        warn_no_voice(chosen.voice)
    print_warnings(realization.warnings)
    if flags["character"] is not None:
        with inputs.reporting(ValueError, "--"):
            realization = realization.with_first(flags["character"])
    if writer is None:
        json.dump(realization.to_json(), sys.stdout)
        sys.stdout.write("\n")
        sys.stdout.flush()
    else:
        path = Path(flags["output"])
        if not realization.has_content:
            click.echo(f"{path}: not written, as there is nothing to play", err=True)
            return 1
        save(realization, writer, path, drawing)
        first, *others = (name or "the unnamed character" for name in realization.characters)
        if others and flags["character"] is None and not writer.all_characters:
            text = f"{path}: shows {first}, not {', '.join(others)}: the format holds one; see --character"
            click.echo(text, err=True)
    dropped = any(schedule.dropped for schedule in realization.schedules)
    if realization.plays_nothing:
        click.echo("nothing is heard or moves, though something was asked for", err=True)
        return 1
    return 1 if realization.refusals or (flags["strict"] and dropped) else 0


def writer_for(output: str | None) -> Output | None:
    """Return the output for the suffix of a path; None without a path or for "-".

    Raises:
        click.BadParameter: an unknown suffix; the text lists the known ones.
    """
    from realizer.outputs.registry import output_for

    if output in (None, "-"):
        return None
    with inputs.reporting(ValueError, wrong=inputs.bad("-o")):
        return output_for(Path(output))


def save(realization: Realization, writer: Output, path: Path, drawing: RenderSettings) -> None:
    """Check the settings, write a realization to a file and print its length."""
    with inputs.reporting(ValueError, "--"):
        writer.check(drawing, realization)
    with inputs.opening(path), steps("drawing") as drawn:
        writer.write(realization, path, replace(drawing, drawn=drawn))
    frames = f"{realization.frames} frames at {realization.fps:g} fps"
    note(f"{path}: {realization.duration:.2f} s, {frames}")


@click.command()
@options.documents
@option("--json", "Print JSON instead of a table.", name="as_json", is_flag=True)
@option("--bml", "Print the documents with all times as numbers.", name="as_bml", is_flag=True)
@option("--detail", "With --json: also gaps, links and dropped behaviours.", is_flag=True)
@option("-o --output FILE", "File to write.  [default: print it]")
@option("--plot FILE", "Draw a timeline as .svg or .png instead of the table.")
@options.playback_options
def schedule(
    documents: tuple[str, ...], output: str | None, plot: str | None, strict: bool, **flags: Any
) -> int:
    """Print the time of every sync point, in seconds from the start of its block.

    \b
    realizer schedule hello.bml
    realizer schedule hello.bml --json --detail
    realizer schedule hello.bml --plot hello.svg

    The documents of --bml have no dropped behaviours and give the same schedule again. A plot has one row per
    behaviour: sync points, gaps coloured by their distance from the preferred length, links, the room before
    and after, and dropped behaviours.
    """
    from realizer.charts.chart_data import charts_of
    from realizer.charts.write_chart import write_timeline
    from realizer.charts.write_chart import writer_for as chart_writer_for
    from realizer.pipeline import plan

    as_json, as_bml, detail = (flags.pop(name) for name in ("as_json", "as_bml", "detail"))
    if as_json and as_bml:
        raise click.UsageError("--json, --bml: wanted one of them, got both")
    if detail and not as_json:
        raise click.UsageError("--detail: wanted --json too")
    if plot is not None:
        with inputs.reporting(ValueError, wrong=inputs.bad("--plot")):
            chart_writer_for(plot)
    chosen = inputs.settings(documents, **flags)
    player = inputs.planning_player(chosen, chosen.scene)
    texts = inputs.read_documents(documents, chosen.language)
    accepted, refused = plan(texts, player, chosen.voice)
    if len(accepted) > 1:  # conflicts of blocks are settled when they start
        player.manager.advance(inf)
    schedules = [player.blocks.latest(planned, whole=True) for planned in accepted]
    if any(speaking.utterance.pcm is None for speaking in player.speech()):
        warn_no_voice(chosen.voice)
    print_warnings(w for w in refused if not any(w in s.warnings for s in schedules))
    for planned in schedules:
        print_warnings(planned.warnings)
    charts = charts_of(player.blocks, accepted) if detail or plot is not None else []
    if as_bml:
        text = _as_documents(texts, schedules, player.strict_bml)
    elif as_json:
        rows: Any = [s.to_json() for s in schedules]
        if detail:
            rows = [row | chart.detail() for row, chart in zip(rows, charts, strict=True)]
        text = json.dumps(rows[0] if len(rows) == len(documents) == 1 else rows, indent=1) + "\n"
    else:
        text = "" if plot is not None else "".join(_table(planned) for planned in schedules)
    if plot is not None:
        with inputs.opening(plot):
            write_timeline(charts, plot)
    if output in (None, "-"):
        click.echo(text, nl=False)
    elif output is not None:
        with inputs.opening(output):
            Path(output).write_text(text, "utf-8")
    return 1 if refused or (strict and any(s.dropped for s in schedules)) else 0


def _table(planned: Schedule) -> str:
    if planned.failed:
        return f"{planned.block}  refused\n"
    lines = [f"{planned.block}  {planned.start:.3f} .. {planned.end:.3f} s"]
    width = max((len(b) for b in planned.times), default=0)
    for behaviour, times in planned.behaviours.items():
        points = "  ".join(f"{name} {time:.3f}" for name, time in times.items())
        lines.append(f"  {behaviour:<{width}}  {points}")
    return "\n".join(lines) + "\n"


def _as_documents(texts: Iterable[str | bytes], schedules: Iterable[Schedule], strict_bml: bool) -> str:
    """Return the documents with the times of their schedules, without refused blocks."""
    from bml_schema import Block, made_ids, read, with_absolute_times, write
    from realizer.behaviours.registry import VOCABULARY

    ids = made_ids()
    read_texts = (read(text, VOCABULARY, strict_bml=strict_bml, block_ids=ids) for text in texts)
    blocks = [item for items in read_texts for item in items if isinstance(item, Block)]
    pairs = zip(blocks, schedules, strict=True)
    return "".join(
        write(with_absolute_times(block, planned.behaviours))
        for block, planned in pairs
        if not planned.failed
    )
