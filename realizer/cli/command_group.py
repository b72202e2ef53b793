"""Groups of commands that are found in a registry and imported when they are used."""

from __future__ import annotations

from typing import Any, NoReturn

import click

from realizer.cli import progress
from realizer.core.errors import PluginError
from realizer.core.registry import Registry

# Name of a command, with a dot between a group and its command -> the object.
COMMANDS: Registry[click.Command] = Registry(
    "realizer.commands",
    {
        "check": "realizer.cli.check:check",
        "demo": "realizer.cli.demo:demo",
        "doctor": "realizer.cli.doctor:doctor",
        "emotion": "realizer.cli.emotion:emotion",
        "enrich": "realizer.cli.enrich:enrich",
        "faces": "realizer.cli.faces:faces",
        "outputs": "realizer.cli.doctor:outputs",
        "plugins": "realizer.cli.doctor:plugins",
        "realize": "realizer.cli.realize:realize",
        "schedule": "realizer.cli.realize:schedule",
        "serve": "realizer.cli.serve:serve",
        "timeline": "realizer.cli.timeline:timeline",
        "voices": "realizer.cli.doctor:voices",
    },
    wanted="a click.Command",
    accepts=lambda value: isinstance(value, click.Command),
)


class CommandGroup(click.Group):
    """A group with the commands of `COMMANDS` whose names begin with its own.

    Attributes:
        path: the name of the group in `COMMANDS` with a dot behind it; "" for `realizer` itself.
    """

    path = ""

    def list_commands(self, context: click.Context) -> list[str]:
        """Return the names of all commands, also of those that cannot be loaded."""
        names = (name.removeprefix(self.path) for name in COMMANDS if name.startswith(self.path))
        return sorted({*self.commands, *(name for name in names if "." not in name)})

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        """Return a command; in place of one that cannot be loaded, one that says why."""
        if name not in self.commands and "." not in name and self.path + name in COMMANDS:
            try:
                command = COMMANDS[self.path + name]
            except PluginError as error:
                command = _missing(name, str(error))
            progress.verbosity(command)
            self.add_command(command, name)
        return self.commands.get(name)


class FaceCommands(CommandGroup):
    """The group `realizer faces`."""

    path = "faces."


def _missing(name: str, fault: str) -> click.Command:
    def fail(**_: Any) -> NoReturn:
        raise PluginError(fault)

    anything = {"ignore_unknown_options": True, "allow_extra_args": True}
    return click.Command(name, anything, fail, short_help=f"Not here: {fault}", help=fault)
