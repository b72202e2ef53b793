"""The command line. Exit status: 0 done, 1 refused, 2 wrong usage, 3 something is missing."""

from __future__ import annotations

import sys

import click

import realizer
from realizer.cli import options
from realizer.cli.align import align
from realizer.cli.batch import batch
from realizer.cli.check import check
from realizer.cli.demo import demo
from realizer.cli.doctor import doctor
from realizer.cli.emotion import emotion
from realizer.cli.enrich import enrich
from realizer.cli.expressions import expressions
from realizer.cli.faces import faces
from realizer.cli.fap import fap
from realizer.cli.list_commands import outputs, voices
from realizer.cli.realize import realize, schedule
from realizer.cli.replay import replay
from realizer.cli.serve import serve
from realizer.cli.timeline import timeline
from realizer.cli.track import track
from realizer.core.errors import RealizerError, TableError

__all__ = ["main"]


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(realizer.__version__, prog_name="realizer")
@click.option("-v", "--verbose", is_flag=True, help=options.VERBOSE)
@click.option("-q", "--quiet", is_flag=True, help=options.QUIET)
@click.pass_context
def cli(context: click.Context, verbose: bool, quiet: bool) -> None:
    """Send it BML, get a living face.

    \b
    realizer demo                          play the examples, leave a film, open a page
    realizer serve                         take BML over a WebSocket, stream faces back
    realizer realize hello.bml -o hello.mp4
    realizer batch talks/ -o films/ --format mp4
    realizer schedule hello.bml            when every sync point falls
    realizer check hello.bml               every fault, with line and path
    realizer emotion guilty                what an emotion looks like, in FAPs or as a picture
    realizer enrich "Are you sure?"        a text becomes BML with expressions

    DOC may be - for standard input. Settings may also come from REALIZER_* variables.
    """
    options.configure_logging(context, quiet=quiet, verbose=verbose)


for command in (
    serve,
    realize,
    schedule,
    check,
    emotion,
    track,
    fap,
    enrich,
    expressions,
    timeline,
    faces,
    voices,
    align,
    outputs,
    batch,
    replay,
    doctor,
    demo,
):
    options.verbosity(command)
    cli.add_command(command)


def main() -> None:
    """Run the command line; never shows a traceback for a fault that has words."""
    try:
        status = cli(standalone_mode=False)
        sys.exit(status if isinstance(status, int) else 0)
    except click.exceptions.Exit as end:
        sys.exit(end.exit_code)
    except click.Abort:
        sys.exit(130)
    except click.ClickException as error:
        error.show()
        sys.exit(error.exit_code)
    except TableError as error:  # a file of the user's own: rules, a mapping, words
        click.echo(f"realizer: {error}", err=True)
        sys.exit(2)
    except RealizerError as error:
        click.echo(f"realizer: {error}", err=True)
        sys.exit(3)
    except BrokenPipeError:
        # The reader of our output went away (`realizer ... | head`): that is not our fault.
        sys.stderr.close()
        sys.exit(0)
    except OSError as error:
        click.echo(
            f"realizer: {error.filename or ''}: {error.strerror or error}".replace(" : ", " "), err=True
        )
        sys.exit(3)
