"""`check`: explains every fault of documents, and gives advice."""

from __future__ import annotations

import os
import shutil
import sys
from itertools import chain, islice
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import options
from realizer.cli.enrich import language, languages_in, mood, role, warn_unknown_languages, words, words_for
from realizer.cli.timeline import advice_on, faults_in, is_timeline
from realizer.core.options import PlayOptions

if TYPE_CHECKING:
    from pathlib import Path

    from realizer.tables.knowledge import Mood, Role

MAX_ADVICE = 20  # on one block: one slip is often made all over a document


@click.command()
@options.documents
@click.option("--scene", type=click.Path(exists=True, dir_okay=False), help="File of targets: name x y z.")
@options.media
@options.expressions
@role
@mood
@language
@words
@click.option(
    "--long/--short",
    "long",
    default=None,
    help="Show source, marks and help, or a line for each fault.  [default: --long on a terminal]",
)
@click.pass_context
def check(
    context: click.Context,
    documents: tuple[str, ...],
    scene: str | None,
    media: Path | None,
    expressions: Path | None,
    role: Role,
    mood: Mood | None,
    language: str | None,
    words: Path | None,
    long: bool | None,
) -> int:
    """Explain every fault of documents, with line, column and path.

    Standard output holds the faults and nothing else; a line each, unless it is a terminal. Advice on what is
    no fault but looks like a slip goes to standard error, and does not count; so does advice on expressions
    that last, follow each other or go with words otherwise than people's do, as who talks or listens.
    A .toml or .json file is a timeline (`realizer timeline`).
    """
    from bml_schema.source import Source
    from realizer.checking.advice import advice
    from realizer.checking.document import check_document
    from realizer.checking.finding import Finding
    from realizer.cli.behaviour_advice import advise_on_behaviours
    from realizer.cli.diagnostics import one_line, render
    from realizer.playback.player import Player

    long = sys.stdout.isatty() if long is None else long
    width = shutil.get_terminal_size((100, 24)).columns

    def show(finding: Finding, source: Source, *, err: bool = False) -> None:
        stream = sys.stderr if err else sys.stdout
        said = render(finding, source, width=width) + "\n" if long else one_line(finding)
        click.echo(said, err=err, color=_coloured(stream))

    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # a document may hold what the terminal's encoding does not
            stream.reconfigure(errors="backslashreplace")
    chosen = options.settings(media=media, expressions=expressions)
    lists = words_for(language, words)
    faults = 0
    told_languages: set[str] = set()
    for name, text in zip(documents, options.read_documents(documents), strict=True):
        if is_timeline(name):
            faults += _check_timeline(name, text, chosen.expressions, role, mood, context.obj["quiet"])
            continue
        # A player a file: what one document says must not colour the next one's report.
        player = Player(
            PlayOptions(
                scene=options.read_scene(scene),
                idle=False,
                media=chosen.media,
                expressions=chosen.expressions,
                language=lists.language,
            )
        )
        source = Source(text)
        blocks = found = 0
        for part in check_document(name, source, text, player):
            blocks += part.block is not None
            found += len(part.findings)
            for finding in part.findings:
                show(finding, source)
            if part.block is not None and part.schedule is not None and not context.obj["quiet"]:
                slips = advice(name, source, part.block, part.schedule, player)
                unusual = advise_on_behaviours(
                    name, source, part.block, part.schedule, part.utterances, role, mood, lists
                )
                if context.obj["verbose"]:
                    warn_unknown_languages(lists, languages_in(part.block, lists), told_languages)
                for finding in islice(chain(slips, unusual), MAX_ADVICE):
                    show(finding, source, err=True)
        if not found and not context.obj["quiet"]:
            click.echo(f"{name}: no fault in {blocks} block{'s' * (blocks != 1)}", err=True)
        faults += found
    return 1 if faults else 0


def _check_timeline(
    name: str, text: bytes, folder: Path | None, role: Role, mood: Mood | None, quiet: bool
) -> int:
    """How many faults a timeline has; each is told, and advice on a sound one."""
    from realizer.expressions.library import library_of

    library = library_of(folder)
    faults = faults_in(text, library)
    for fault in faults:
        click.echo(f"{name}: {fault}")
    if not faults and not quiet:
        for words in advice_on(text, library, role, mood):
            click.echo(f"{name}: ADVICE {words}", err=True)
        click.echo(f"{name}: no fault in this timeline", err=True)
    return len(faults)


def _coloured(stream: Any) -> bool:
    """Whether a stream is a terminal whose user has not said no to colours (https://no-color.org)."""
    return bool(stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb")
