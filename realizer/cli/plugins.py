"""`plugins`: lists what other packages add."""

import json

import click

from realizer.cli import options


@click.command()
@options.as_json
def plugins(as_json: bool) -> None:
    """List the behaviours, outputs, voices, transports and faces of other packages.

    Prints group, name, package and object of each, and why it cannot be used if so.
    """
    from dataclasses import asdict

    from realizer.behaviours.registry import FAMILIES
    from realizer.face.load import FACES
    from realizer.outputs.registry import OUTPUTS
    from realizer.server.transports.transport import TRANSPORTS
    from realizer.speech.registry import VOICES

    found = [p for registry in (FAMILIES, OUTPUTS, VOICES, TRANSPORTS, FACES) for p in registry.plugins()]
    if as_json:
        click.echo(json.dumps([asdict(plugin) for plugin in found], indent=1))
        return
    for plugin in found:
        fault = f"  (not used: {plugin.fault})" if plugin.fault else ""
        click.echo(f"{plugin.group:<20} {plugin.name:<12} {plugin.package:<16} {plugin.value}{fault}")
    if not found:
        options.note("no plug-ins are installed; docs/adding.md says how to write one")
