"""`demo`: plays the examples over the wire, films them, and serves the page."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from bml_schema import Feedback

FILM, FRAMES = Path("demo.mp4"), Path("demo.fap")


@click.command()
@click.option("--once", is_flag=True, help="End when the examples have been played.")
@click.option(
    "--port", default=8765, show_default=True, help="Of the page; a free one is taken if it is in use."
)
@click.option("--voice", metavar="NAME", help="A voice of `realizer voices`.")
@click.option("--face", default="default", show_default=True, help="A face of `realizer faces list`.")
def demo(once: bool, port: int, voice: str | None, face: str) -> None:
    """Play the examples: serve them, film them, and give the page's address.

    Leaves demo.mp4 and demo.fap in the current folder.
    """
    import asyncio

    from realizer.examples import examples

    documents = examples()
    _film(list(documents.values()), voice, face)
    asyncio.run(_serve(documents, once, port, voice, face))


def _film(documents: list[str], voice: str | None, face: str) -> None:
    """All examples one after the other into demo.fap and demo.mp4."""
    from realizer.cli.options import warn_no_voice
    from realizer.core.errors import RealizerError
    from realizer.offline import realize
    from realizer.outputs.output import RenderSettings
    from realizer.outputs.registry import output_for

    appended = [text.replace("<bml ", '<bml composition="APPEND" ', 1) for text in documents]
    realization = realize(appended, face=face, voice=voice)
    warn_no_voice(voice)
    for path in (FRAMES, FILM):
        click.echo(f"writing {path} ({realization.duration:.1f} s) ...")
        try:
            output_for(path).write(realization, path, RenderSettings())
        except RealizerError as error:
            click.echo(f"realizer: {path} was left out: {error}", err=True)


def _line(feedback: Feedback) -> str:
    """Feedback as a line for people; predictions are left to programs."""
    from bml_schema import BlockProgress, SyncPointProgress, WarningFeedback

    match feedback:
        case BlockProgress() | SyncPointProgress():
            return f"  {feedback.global_time:8.3f} s  {feedback.id}"
        case WarningFeedback():
            return f"  warning     {feedback.id}: {feedback.type}: {feedback.text}"
    return ""


async def _serve(documents: dict[str, str], once: bool, port: int, voice: str | None, face: str) -> None:
    """Serve, send every example as a client would, print what is told of it and when."""
    from realizer.client import connect
    from realizer.core.settings import Settings
    from realizer.server.serve import Server

    settings = Settings.read({"port": port, "voice": voice, "face": face})
    try:
        server = await Server(settings).start()
    except OSError:
        server = await Server(replace(settings, port=0)).start()
    try:
        click.echo(f"page: http://{settings.host}:{server.port}/?session=demo")
        async with connect(f"ws://{settings.host}:{server.port}/ws?session=demo") as client:
            for name, text in documents.items():
                click.echo(f"\n{name}")
                await client.send(text)
                async for feedback in client.until_end():
                    if line := _line(feedback):
                        click.echo(line)
        if not once:
            click.echo("\nthe page is open for you; Ctrl-C ends")
            await server.wait_closed()
    finally:
        await server.close()
