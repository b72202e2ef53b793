"""`check`: explains every fault of documents, and gives advice."""

from __future__ import annotations

import os
import shutil
import sys
from dataclasses import replace
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import inputs, options
from realizer.cli.enrich import mood, role, warn_unknown_languages, words, words_for
from realizer.cli.options import option
from realizer.cli.progress import is_quiet, note
from realizer.cli.timeline import SUFFIXES, advice_on, faults_in

if TYPE_CHECKING:
    from realizer.tables.knowledge import Mood, Role


IMPOSSIBLE = "IMPOSSIBLE_LENGTH"  # type of faults by --limit


@click.command()
@options.documents
@options.scene
@options.media
@options.expressions
@options.strict_bml
@role
@mood
@options.language
@words
@option(
    "--long/--short",
    "Show the source with marks and help, or one line per fault.  [default: --long on a terminal]",
    default=None,
)
@option(
    "--limit",
    "Count expressions that are shorter or longer than was ever observed as faults, not as advice.",
    is_flag=True,
)
@click.pass_context
def check(
    context: click.Context,
    /,
    documents: tuple[str, ...],
    words: Path | None,
    long: bool | None,
    limit: bool,
    **flags: Any,
) -> int:
    """Explain every fault of documents, with line, column and path.

    \b
    realizer check hello.bml
    realizer check --scene room.txt --mood happy hello.bml

    Faults go to standard output, one line each unless it is a terminal, and nothing else does. Advice goes
    to standard error and does not change the exit status: about likely mistakes, and about expressions whose
    duration, order or words are unusual for a person in this role and mood. A .toml or .json file is checked
    as a timeline (see `realizer timeline`).
    """
    from bml_schema.source import Source
    from realizer.checking.advice import advice, advise_on_behaviours
    from realizer.checking.document import check_document
    from realizer.checking.finding import Finding
    from realizer.checking.source import MAX_ADVICE
    from realizer.cli.diagnostics import render
    from realizer.enrichment import languages_in

    long = sys.stdout.isatty() if long is None else long
    width = shutil.get_terminal_size((100, 24)).columns

    def show(finding: Finding, source: Source, *, err: bool = False) -> None:
        stream = sys.stderr if err else sys.stdout
        text = render(finding, source, width=width) + "\n" if long else str(finding)
        click.echo(text, err=err, color=_is_coloured(stream))

    for stream in (sys.stdout, sys.stderr):
        if hasattr(stream, "reconfigure"):  # the terminal's encoding may lack characters of a document
            stream.reconfigure(errors="backslashreplace")
    scene, who = flags.pop("scene"), (flags.pop("role"), flags.pop("mood"))
    chosen, lists = inputs.settings(documents, **flags), words_for(flags["language"], words)
    faults = 0
    warned: set[str] = set()
    for name, text in zip(documents, inputs.read_documents(documents, chosen.language), strict=True):
        if Path(name).suffix.lower() in SUFFIXES and isinstance(text, bytes):
            faults += _check_timeline(name, text, chosen.expressions, who, limit)
            continue
        # Each file has a player of its own, so that reports are independent.
        player = inputs.planning_player(chosen, scene)
        source = Source(text)
        blocks = found = 0
        for part in check_document(name, source, text, player):
            blocks += part.block is not None
            found += len(part.findings)
            for finding in part.findings:
                show(finding, source)
            if part.block is not None and part.schedule is not None and (limit or not is_quiet()):
                slips = advice(name, source, part.block, part.schedule, player)
                unusual = list(advise_on_behaviours(name, source, part, *who, lists))
                if context.obj["verbose"]:
                    warn_unknown_languages(lists, languages_in(part.block, lists), warned)
                impossible = [finding for finding in unusual if limit and finding.is_impossible]
                found += len(impossible)
                for finding in impossible:
                    show(replace(finding, type=IMPOSSIBLE), source)
                hints = chain(slips, (finding for finding in unusual if finding not in impossible))
                for finding in () if is_quiet() else islice(hints, MAX_ADVICE):
                    show(finding, source, err=True)
        if not found:
            note(f"{name}: no fault in {blocks} block{'s' * (blocks != 1)}")
        faults += found
    return 1 if faults else 0


def _check_timeline(
    name: str, text: bytes, folder: Path | None, who: tuple[Role, Mood | None], limit: bool
) -> int:
    """Print the faults of a timeline, or advice if it has none, and return the number of faults."""
    from realizer.expressions.library import library_of

    library = library_of(folder)
    faults = faults_in(text, library)
    if limit and not faults:
        faults = [f"{IMPOSSIBLE} {fault}" for fault in advice_on(text, library, *who, impossible=True)]
    for fault in faults:
        click.echo(f"{name}: {fault}")
    if not faults and not is_quiet():
        for advice in advice_on(text, library, *who):
            note(f"{name}: ADVICE {advice}")
        note(f"{name}: no fault in this timeline")
    return len(faults)


def _is_coloured(stream: Any) -> bool:
    """Return whether a stream is a terminal that shows colours (https://no-color.org)."""
    return bool(stream.isatty() and not os.environ.get("NO_COLOR") and os.environ.get("TERM") != "dumb")
