"""Tests of `realizer.cli.command_group`."""

from __future__ import annotations

import click
import pytest
from click.testing import CliRunner

from realizer.cli.command_group import COMMANDS, CommandGroup, FaceCommands
from realizer.core.errors import PluginError


def test_groups_share_the_registry_by_the_names_before_the_dot() -> None:
    context = click.Context(click.Command("x"))
    commands, faces = CommandGroup("realizer"), FaceCommands("faces")
    assert {"serve", "realize", "faces", "corpus"} <= set(commands.list_commands(context))
    assert not [name for name in commands.list_commands(context) if "." in name]
    assert {"build", "check", "import"} <= set(faces.list_commands(context))
    assert faces.get_command(context, "serve") is None
    assert faces.get_command(context, "nothing") is None


@pytest.mark.parametrize("arguments", [["lost"], ["lost", "-o", "x", "y"], ["lost", "sub", "--flag"]])
def test_command_that_cannot_be_loaded_says_what_is_missing(
    arguments: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def load(name: str) -> click.Command:
        raise PluginError(f"{name} needs the package x: pip install x")

    monkeypatch.setitem(COMMANDS._ours, "lost", "x:lost")
    monkeypatch.setattr(COMMANDS, "_load", load)
    result = CliRunner().invoke(CommandGroup("realizer"), arguments)
    assert str(result.exception) == "lost needs the package x: pip install x"
