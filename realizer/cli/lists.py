"""`voices` and `outputs`: what there is, and how to get what is missing."""

from __future__ import annotations

import click

__all__: list[str] = []


@click.command()
def voices() -> None:
    """List the voices, and say how to get the missing ones."""
    from realizer.speech import voices as known

    for voice in known():
        click.echo(f"{voice.name:<16} {voice.says}")


@click.command()
def outputs() -> None:
    """List what `realize -o` can write, by suffix."""
    from realizer.outputs import OUTPUTS

    width, kinds = (max(map(len, column)) for column in (OUTPUTS, (o.media_type for o in OUTPUTS.values())))
    for suffix, output in sorted(OUTPUTS.items()):
        needs = f"  (needs bml-realizer[{output.needs}])" if output.needs else ""
        click.echo(f"{suffix:<{width}}  {output.media_type:<{kinds}}  {output.says}{needs}")
