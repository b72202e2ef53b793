"""`timeline`: plays a timeline file or prints its faults."""

from __future__ import annotations

from itertools import chain, islice
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import quoteattr

import click

from realizer.cli import inputs, options
from realizer.cli.realize import output_options, play_documents
from realizer.core.errors import TableError

if TYPE_CHECKING:
    from realizer.expressions.library import Library
    from realizer.tables.knowledge import Mood, Role

SUFFIXES = (".toml", ".json")
MAX_ADVICE = 20


@click.command()
@click.argument("file", type=options.FILE)
@output_options
def timeline(file: Path, **flags: Any) -> int:
    """Play a timeline: channels of expressions that blend into each other (Wojdel 2005, 5.4).

    FILE is TOML or JSON. In a BML document, <realizer:timeline fileName="..."/> plays a file of the media
    folder.

    \b
    mixer = "successive"      # with --deformer au; the default is "additive"
    order = [4, 1, 2]         # action units that come first

    \b
    [[channel]]
    name = "brows"
    joins = "both"            # transition between entries; or "onset", "offset"
    curve = "linear"          # or "smooth"
    start = 0.0               # seconds
    entries = [
        { expression = "template:surprise", intensity = 0.8, duration = 1.2 },
        { expression = "neutral", duration = 0.5 },
        { expression = "template:anger", onset = 0.2, offset = 0.6 },
    ]

    \b
    realizer timeline brows.toml -o brows.mp4
    realizer check brows.toml
    """
    from bml_schema import CORE, OWN
    from realizer.expressions.library import library_of

    if flags["media"] is not None:
        raise click.BadParameter("a timeline refers to no files", param_hint="--media")
    inputs.check_suffix(file, *SUFFIXES)
    chosen = inputs.settings(expressions=flags["expressions"])
    if faults := list(faults_in(file.read_bytes(), library_of(chosen.expressions))):
        for fault in faults:
            click.echo(f"{file}: {fault}", err=True)
        return 1
    node = f'<own:timeline id="timeline" fileName={quoteattr(file.name)}/>'
    document = f'<bml xmlns="{CORE}" xmlns:own="{OWN}" id="timeline">{node}</bml>'
    return play_documents(lambda: [document.encode()], flags | {"media": file.parent})


def faults_in(content: bytes, library: Library) -> list[str]:
    """Return the faults of a timeline, each with its channel and entry."""
    from realizer.expressions.timeline import faults_of
    from realizer.expressions.timeline_file import read_timeline

    try:
        return faults_of(read_timeline(content), library)
    except TableError as error:
        return str(error).splitlines()


def advice_on(
    content: bytes, library: Library, role: Role, mood: Mood | None, *, impossible: bool = False
) -> list[str]:
    """Return advice on a timeline without faults: what is unusual for people, and what would be usual.

    Args:
        impossible: whether to return only what was never observed.
    """
    from realizer.checking.timeline_advice import timeline_advice
    from realizer.expressions.timeline import remarks
    from realizer.expressions.timeline_file import read_timeline

    timeline = read_timeline(content)
    advice = (
        f"{item.id + ': ' if item.id else ''}{item.text}; {item.hint}"
        for item in timeline_advice(timeline, library, role, mood)
        if item.is_impossible or not impossible
    )
    return list(islice(chain(() if impossible else remarks(timeline), advice), MAX_ADVICE))
