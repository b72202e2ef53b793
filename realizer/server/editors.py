"""The registry of editors, the tools of the page that answer its messages on a WebSocket of their own.

Each is an entry point of the group `realizer.editors`; the editor `label` answers at /label.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable
from typing import Protocol

from realizer.core.errors import PluginError
from realizer.core.json_reader import parse_json
from realizer.core.registry import Registry
from realizer.core.settings import Settings

log = logging.getLogger(__name__)


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
        return _error(message, self._fault)

    def close(self) -> None:
        """Nothing is held."""


def answer_of(editor: Editor, message: str | bytes) -> str | bytes:
    """Return an editor's answer to a message; whatever fails costs this message only."""
    try:
        return editor.answer(message)
    except Exception as error:
        log.exception("an editor has no answer")
        return _error(message, f"an error of the service ({type(error).__name__}): its log says which")


def _error(message: str | bytes, fault: str) -> str:
    text = message if isinstance(message, str) else message[4 : 4 + int.from_bytes(message[:4], "little")]
    try:
        number = parse_json(text).get("id")
    except (ValueError, AttributeError):
        number = None
    return json.dumps({"id": number, "error": fault})


def editor_of(name: str, settings: Settings, *, may_save: bool) -> Editor:
    """Return a new editor for one page; raises KeyError for an unknown name."""
    try:
        make = EDITORS[name]
    except PluginError as error:
        return MissingEditor(str(error))
    return make(settings, may_save)
