"""`explain`: shows how a document goes through the eight steps."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from realizer.cli import inputs, options
from realizer.cli.options import option
from realizer.cli.progress import print_warnings


@click.command()
@options.documents
@option(
    "-o --output FILE",
    "Write a page (.html), or a drawing of the steps (.svg, .png).  [default: print text]",
    options.OUTPUT,
)
@options.face("Face that is moved")
@option("--no-idle", "No blinks or small head motion of an idle face.", is_flag=True)
@options.playback_options
def explain(
    documents: tuple[str, ...], output: Path | None, no_idle: bool, strict: bool, **flags: Any
) -> int:
    """Explain how a document goes through the eight steps, from text to picture.

    \b
    realizer explain hello.bml
    realizer explain "Hello there" -o hello.html
    realizer explain hello.bml -o hello.svg

    Prints the nodes, the gaps that behaviours prefer, the scheduling problem and its solution, the channels,
    the strongest action units and FAPs, and how far the face moves.
    """
    from realizer.charts.write_chart import WRITERS

    inputs.check_suffix(output, ".html", *WRITERS)
    chosen = inputs.settings(documents, **flags)
    texts = inputs.read_documents(documents, chosen.language)
    from realizer import pipeline
    from realizer.result import Realization
    from realizer_studio.explained import as_html, as_picture, as_text, steps_of

    play = chosen.play_options(inputs.read_scene(chosen.scene))
    played = Realization.of(pipeline.play(texts, replace(play, idle=play.idle and not no_idle), chosen.voice))
    print_warnings(played.warnings)
    if not played.has_content:
        return 1
    steps = steps_of(played)
    if output is None:
        click.echo(as_text(steps), nl=False)
    else:
        with inputs.opening(output):
            write = WRITERS.get(output.suffix.lower())
            page = as_html(steps, played).encode() if write is None else write(as_picture(steps, played))
            output.write_bytes(page)
    dropped = any(schedule.dropped for schedule in played.schedules)
    return 1 if played.refusals or played.plays_nothing or (strict and dropped) else 0
