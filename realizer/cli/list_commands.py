"""`voices` and `outputs`: list the registered ones and how to install missing parts."""

from __future__ import annotations

from functools import cache
from importlib.util import find_spec

import click

MODULES = {"film": "av"}  # extra -> a module that it installs


@click.command()
def voices() -> None:
    """List the voices that --voice takes, and how to install missing ones."""
    from realizer.speech.registry import voices as all_voices

    for voice in all_voices():
        click.echo(f"{voice.name:<16} {voice.description}")


@click.command()
def outputs() -> None:
    """List the file formats that `realize -o` writes.

    Prints suffix, media type and contents, and what to install where something is missing.
    """
    from realizer.outputs.registry import OUTPUTS

    working = sorted(OUTPUTS.working())
    width = max(len(suffix) for suffix, _ in working)
    type_width = max(len(output.media_type) for _, output in working)
    for suffix, output in working:
        fixes = "; ".join(filter(None, map(_fix, output.needs)))
        missing = f"  (missing: {fixes})" if fixes else ""
        click.echo(f"{suffix:<{width}}  {output.media_type:<{type_width}}  {output.description}{missing}")


@cache
def _fix(extra: str) -> str | None:
    """Return how to install an extra, or None if it works."""
    if extra == "render":
        from realizer.render import available

        return available()
    return None if find_spec(MODULES[extra]) else f"pip install 'bml-realizer[{extra}]'"
