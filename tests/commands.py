"""Commands of `realizer`, run in the process of the tests."""

from __future__ import annotations

from typing import NamedTuple

import click
from click.testing import CliRunner

from realizer.cli import main

__all__ = ["Finished", "run"]


class Finished(NamedTuple):
    """A command that has ended: its exit status and what it has written."""

    returncode: int
    stdout: str
    stderr: str


def run(*arguments: str, stdin: str | bytes = "") -> Finished:
    """Run a command as `python -m realizer` does, but without a process of its own."""
    with CliRunner().isolation(input=stdin) as (stdout, stderr, _):
        try:
            main(list(arguments))
        except SystemExit as end:
            status = end.code
    assert isinstance(status, int)
    return Finished(status, stdout.getvalue().decode(), stderr.getvalue().decode())


def members(group: click.Group) -> dict[str, click.Command]:
    """Return the commands of a group by name."""
    context = click.Context(group)
    found = {name: group.get_command(context, name) for name in group.list_commands(context)}
    return {name: command for name, command in found.items() if command is not None}
