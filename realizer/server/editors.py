"""The registry of editors, the tools of the page that answer its messages on a WebSocket of their own.

Each is an entry point of the group `realizer.editors`; the editor `label` answers at /label.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Protocol

from realizer.core.errors import PluginError
from realizer.core.registry import Registry
from realizer.core.settings import Settings


class Editor(Protocol):
    """The answers to the messages of one page. Called in a thread, one message after the other."""

    def answer(self, message: str | bytes) -> str | bytes:
        """Return the answer to a message: JSON with the `id` of the message, or JSON with bytes behind it.

        What cannot be done is answered by {"id", "error": sentence}.
        """

    def close(self) -> None:
        """Free what the editor holds; the page has gone."""


# Each takes the settings of the service, and whether the page may save.
EDITORS: Registry[Callable[[Settings, bool], Editor]] = Registry(
    "realizer.editors",
    {},
    wanted="a function or class that takes the settings and whether the page may save",
    accepts=callable,
)


class MissingEditor:
    """The editor in place of one that cannot be loaded: every answer says what is missing."""

    def __init__(self, fault: str) -> None:
        self._fault = fault

    def answer(self, message: str | bytes) -> str:
        """Return the fault as the answer to a message."""
        text = message if isinstance(message, str) else message[4 : 4 + int.from_bytes(message[:4], "little")]
        try:
            number = json.loads(text).get("id")
        except (ValueError, AttributeError, RecursionError):
            number = None
        return json.dumps({"id": number, "error": self._fault})

    def close(self) -> None:
        """Nothing is held."""


def editor_of(name: str, settings: Settings, *, may_save: bool) -> Editor:
    """Return a new editor for one page; raises KeyError for an unknown name."""
    try:
        make = EDITORS[name]
    except PluginError as error:
        return MissingEditor(str(error))
    return make(settings, may_save)
