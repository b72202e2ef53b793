"""The command line interface."""

import errno
import signal
import sys
import threading
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import NoReturn

import click

import realizer
from realizer.cli import progress
from realizer.cli.command_group import CommandGroup
from realizer.cli.options import option
from realizer.core.errors import RealizerError, TableError, UnknownNameError
from realizer.core.threads import use_one_thread

__all__ = ["main"]


@click.group(
    cls=CommandGroup, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100}
)
@click.version_option(realizer.__version__, prog_name="realizer")
@option("-v --verbose", progress.VERBOSE, is_flag=True)
@option("-q --quiet", progress.QUIET, is_flag=True)
@click.pass_context
def cli(context: click.Context, verbose: bool, quiet: bool) -> None:
    """Turn BML, the Behavior Markup Language, into an animated, speaking face.

    \b
    Start here:
      realizer demo                             play the examples, make a film, open a page
      realizer realize hello.bml -o hello.mp4   a film, picture, sound or animation data
      realizer check hello.bml                  explain every mistake in a document
      realizer schedule hello.bml               print the time of every sync point
      realizer serve                            play BML from a WebSocket, stream the face back

    \b
    `realizer COMMAND --help` explains a command with examples. DOC is a file, or - for
    standard input; a TEXT is spoken. Options can also be set by variables: REALIZER_FPS=30 means --fps 30.
    `realizer doctor` checks the installation.

    \b
    Exit status:
      0  success; warnings are on standard error
      1  a document was refused, or `check` found a fault
      2  wrong usage, such as an unknown option, face or voice
      3  something is missing on this machine; the message says what
    130  it was interrupted (Ctrl-C), 143 terminated; a file that it was writing is as it was before
    """
    use_one_thread()
    progress.configure_logging(context, quiet=quiet, verbose=verbose)


def main(arguments: Sequence[str] | None = None) -> NoReturn:
    """Run the command line and exit; known errors become a line on standard error.

    Args:
        arguments: words after `realizer`; None: those of the process.
    """
    try:
        with _exiting_on_signals():
            status = cli(arguments, standalone_mode=False)
        sys.exit(status if isinstance(status, int) else 0)
    except click.Abort:
        sys.exit(130)
    except click.ClickException as error:
        if isinstance(error, click.exceptions.NoArgsIsHelpError):
            error.show()
        else:
            click.echo(f"realizer: {error.format_message()}{_help_of(error)}", err=True)
        sys.exit(error.exit_code)
    except RealizerError as error:
        click.echo(f"realizer: {error}", err=True)
        # A TableError is in a file of the user: rules, a mapping, words.
        sys.exit(2 if isinstance(error, TableError | UnknownNameError) else 3)
    except OSError as error:
        advice = "; choose another one with --port" if error.errno == errno.EADDRINUSE else ""
        words = f"realizer: {error.filename or ''}: {error.strerror or error}{advice}"
        click.echo(words.replace(" : ", " "), err=True)
        sys.exit(2 if isinstance(error, FileNotFoundError) else 3)


# Signal -> what standard error says of it.
ENDS = {signal.SIGINT: "interrupted", signal.SIGTERM: "terminated"}


@contextmanager
def _exiting_on_signals() -> Iterator[None]:
    """Exit with 130 or 143 at a signal, after all `finally` blocks; a second one ends the process at once.

    Commands that end in order by themselves, such as `serve`, have handlers of their own.
    """
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread can have handlers
        return

    def end(number: int, frame: object) -> NoReturn:
        for each in ENDS:
            signal.signal(each, signal.SIG_DFL)
        click.echo(f"realizer: {ENDS[signal.Signals(number)]}", err=True)
        sys.exit(128 + number)

    before = {each: signal.signal(each, end) for each in ENDS}
    try:
        yield
    finally:
        for each, handler in before.items():
            signal.signal(each, handler)


def _help_of(error: click.ClickException) -> str:
    """Return where wrong usage is explained, or ""."""
    context = getattr(error, "ctx", None)
    return "" if context is None else f"\nrealizer: see {context.command_path} --help"
