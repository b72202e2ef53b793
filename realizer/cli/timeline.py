"""`timeline`: plays a timeline file, or reports what is wrong with it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import click

from realizer.cli import options
from realizer.cli.realize import output_options, play_documents

if TYPE_CHECKING:
    from realizer.expressions.library import Library
    from realizer.expressions.timeline import Timeline
    from realizer.tables.knowledge import Mood, Role

SUFFIXES = (".toml", ".json")
MAX_ADVICE = 20
OWN = "urn:bml-realizer:1"
CORE = "http://www.bml-initiative.org/bml/bml-1.0"


@click.command()
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@output_options
@click.pass_context
def timeline(context: click.Context, /, file: Path, **asked: Any) -> int:
    """Play a timeline: channels of expressions that grow out of each other (Wojdel 2005, 5.4).

    FILE is TOML or JSON. In a document, <realizer:timeline fileName="..."/> plays a file of the media folder.

    \b
    mixer = "successive"      # or "additive", which is usual: with --deformer au
    order = [4, 1, 2]         # the action units that come first

    \b
    [[channel]]
    name = "brows"
    joins = "both"            # or "onset", "offset": what leads from one entry to the next
    curve = "linear"          # or "smooth"
    start = 0.0               # seconds
    entries = [
        { expression = "template:surprise", intensity = 0.8, duration = 1.2 },
        { expression = "neutral", duration = 0.5 },
        { expression = "template:anger" },
    ]

    \b
    realizer timeline brows.toml -o brows.mp4
    realizer check brows.toml
    """
    from realizer.expressions.library import library_of

    if asked["media"] is not None:
        raise click.BadParameter("a timeline names no files", param_hint="--media")
    if file.suffix.lower() not in SUFFIXES:
        raise click.UsageError(f"{file}: wanted a name that ends in {' or '.join(SUFFIXES)}")
    chosen = options.settings(expressions=asked["expressions"])
    if faults := list(faults_in(file.read_bytes(), library_of(chosen.expressions))):
        for fault in faults:
            click.echo(f"{file}: {fault}", err=True)
        return 1
    node = f'<own:timeline id="timeline" fileName={quoteattr(file.name)}/>'
    document = f'<bml xmlns="{CORE}" xmlns:own="{OWN}" id="timeline">{node}</bml>'
    return play_documents(context, lambda: [document.encode()], asked | {"media": file.parent})


def is_timeline(name: str) -> bool:
    """Whether a file that is to be checked is a timeline, by its name."""
    return Path(name).suffix.lower() in SUFFIXES


def faults_in(content: bytes, library: Library) -> list[str]:
    """All that is wrong with a timeline: channel, entry, what was wanted, what came."""
    from realizer.core.errors import TableError
    from realizer.expressions.timeline import faults_of
    from realizer.expressions.timeline_reader import read_timeline

    try:
        return faults_of(read_timeline(content), library)
    except TableError as error:
        return str(error).splitlines()


def advice_on(content: bytes, library: Library, role: Role, mood: Mood | None) -> list[str]:
    """What people's faces do otherwise than those of a sound timeline, and what would be usual."""
    from realizer.expressions.timeline import remarks
    from realizer.expressions.timeline_reader import read_timeline

    timeline = read_timeline(content)
    found = chain(remarks(timeline), _advice(timeline, library, role, mood))
    return list(islice(found, MAX_ADVICE))


def _advice(timeline: Timeline, library: Library, role: Role, mood: Mood | None) -> Iterator[str]:
    from bml_schema import Block
    from realizer.expressions.spans import visible_spans
    from realizer.knowledge.advice import VisibleExpression, advise, duration_advice

    seen = []
    for place, expression, begin, end in visible_spans(timeline, library):
        family, _, template = expression.name.rpartition(":")
        if family == "template" and expression.file is None:
            seen.append(VisibleExpression(place, template, begin, end))
            continue
        source = str(expression.file or expression.source)
        for one in duration_advice(
            place, expression.name, end - begin, expression.possible, expression.probable, source
        ):
            yield f"{one.id}: {one.text}; {one.hint}"
    for one in advise(Block(id="timeline"), seen, {}, role, mood):
        yield f"{one.id + ': ' if one.id else ''}{one.text}; {one.hint}"
