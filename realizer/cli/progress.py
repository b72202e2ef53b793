"""What commands print on standard error: notes, warnings and progress, and how much of it."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack, contextmanager
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from realizer.scheduling.timing import Warning

QUIET, VERBOSE = "Print only errors on standard error.", "Print more on standard error."


def verbosity(command: click.Command) -> None:
    """Add -q and -v to a command, or to each command of a group, as `realizer` itself has them."""
    if isinstance(command, click.Group):
        for member in command.commands.values():
            verbosity(member)
        return
    for flags, words in ((("-q", "--quiet"), QUIET), (("-v", "--verbose"), VERBOSE)):
        option = click.Option(flags, is_flag=True, expose_value=False, callback=_set_verbosity, help=words)
        command.params.append(option)


def _set_verbosity(context: click.Context, parameter: click.Parameter, value: bool) -> None:
    if value:
        configure_logging(context, **{str(parameter.name): True})


def configure_logging(context: click.Context, *, quiet: bool = False, verbose: bool = False) -> None:
    """Set how much is logged to standard error; -q and -v come before or after the command's name."""
    import logging

    from realizer.core.logs import write_words

    context.obj = {"quiet": quiet, "verbose": verbose}
    write_words(logging.ERROR if quiet else logging.DEBUG if verbose else logging.WARNING)
    # Writing a long film reports its progress.
    logging.getLogger("realizer.outputs").setLevel(logging.ERROR if quiet else logging.INFO)


def is_quiet() -> bool:
    """Return whether --quiet is in effect."""
    return bool((click.get_current_context().obj or {}).get("quiet"))


def note(text: str) -> None:
    """Print a line on standard error, unless --quiet is in effect."""
    if not is_quiet():
        click.echo(text, err=True)


def bar(
    items: Iterable[Any] | None, count: int, label: str | None = None, least: int = 0, **looks: Any
) -> Any:
    """Return a context of the same items that shows a bar on standard error, unless --quiet is in effect.

    Args:
        count: of the items; 0: unknown.
        least: for fewer items there is no bar.
    """
    looks["hidden"] = is_quiet() or 0 < count < least
    return click.progressbar(items, length=count or None, label=label, file=sys.stderr, **looks)


@contextmanager
def counting(label: str, count: int) -> Iterator[Callable[[int], Any]]:
    """Give a function that takes how many further steps of a work are done, for a bar."""
    with bar(None, count, label) as shown:
        yield shown.update


@contextmanager
def steps(label: str) -> Iterator[Callable[..., None]]:
    """Give a function (done, count, text="") that shows how much of a work is done.

    On a terminal it shows a bar; elsewhere the texts are printed, a line each.
    """
    with ExitStack() as stack:
        shown: Any = None

        def show(done: int, count: int, text: str = "") -> None:
            nonlocal shown
            if not sys.stderr.isatty():
                if text:
                    note(f"{label}: {text} ...")
                return
            if shown is None:
                one = bar(None, count, label, least=2, item_show_func=lambda item: item or "")
                shown = stack.enter_context(one)
            shown.update(done - shown.pos, text)

        yield show


@contextmanager
def waiting(label: str) -> Iterator[None]:
    """Show on a terminal for how many seconds a work lasts that has no steps to count."""
    over, began = threading.Event(), time.monotonic()

    def show() -> None:
        while not over.wait(1.0):
            click.echo(f"\r{label}: {time.monotonic() - began:.0f} s", nl=False, err=True)
        click.echo("\r" + " " * (len(label) + 10) + "\r", nl=False, err=True)

    if not sys.stderr.isatty() or is_quiet():
        yield
        return
    thread = threading.Thread(target=show, daemon=True)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join()


def warn_no_voice(voice: str | None) -> None:
    """Print a warning if no voice was requested and only the silent one is installed."""
    from realizer.speech.registry import find_voice, voices

    if voice is None and find_voice(None).name == "silent":
        missing = next((v.description for v in voices() if not v.available), "")
        click.echo(f"realizer: no voice is installed, speech is silent; {missing}", err=True)


def print_warnings(warnings: Iterable[Warning]) -> None:
    """Print warnings about documents on standard error, one line each."""
    for warning in warnings:
        click.echo(f"{warning.id}: {warning.type}: {warning.text}", err=True)
