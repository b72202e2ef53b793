"""`voices` and `outputs`: list what there is, and how to get what is missing."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec

import click

MODULES = {"film": "av"}  # an extra, and what it installs


@click.command()
def voices() -> None:
    """List the voices, and say how to get the missing ones."""
    from realizer.speech.registry import voices as known

    for voice in known():
        click.echo(f"{voice.name:<16} {voice.description}")


@click.command()
def outputs() -> None:
    """List what `realize -o` can write, by suffix, and how to get what is missing for it."""
    from realizer.outputs.registry import OUTPUTS

    found = dict(OUTPUTS.working())
    width, kinds = (max(map(len, column)) for column in (found, (o.media_type for o in found.values())))
    for suffix, output in sorted(found.items()):
        fixes = [fix for fix in map(_missing, output.needs) if fix is not None]
        mark = f"  (missing: {'; '.join(fixes)})" if fixes else ""
        click.echo(f"{suffix:<{width}}  {output.media_type:<{kinds}}  {output.description}{mark}")


@cache
def _missing(extra: str) -> str | None:
    """What to do about an extra that is not there, or does not work here."""
    if extra == "render":
        from realizer.render import available

        return available()
    return None if find_spec(MODULES[extra]) else f"pip install 'bml-realizer[{extra}]'"
