"""`demo`: plays the examples over the wire, films them, and serves the page."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from realizer.cli import options
from realizer.cli.options import option
from realizer.cli.progress import steps, warn_no_voice
from realizer.core.errors import RealizerError
from realizer.core.settings import Settings

if TYPE_CHECKING:
    from bml_schema import Feedback

FILM, FRAMES = Path("demo.mp4"), Path("demo.fap")
NEXT = """now try:
  realizer realize "Hello there" -o hello.mp4      speak a text
  realizer enrich "Are you sure?" -o sure.bml      turn a text into BML with expressions
  realizer realize sure.bml -o sure.png --face ben draw it with another face
  realizer explain sure.bml                        see how it goes through the eight steps
  realizer serve                                   play BML from a WebSocket"""


@click.command()
@option("--once", "Exit after playing the examples.", is_flag=True)
@option("--port", "Port of the page; if it is in use, a free one is chosen.", default=8765)
@options.voice
@options.face("Face to show", default="default", show_default=True)
def demo(once: bool, port: int, voice: str | None, face: str) -> None:
    """Play the examples: write a film of them, then serve a page that shows them.

    Writes demo.mp4 and demo.fap to the current folder, prints the page's address, and plays the examples
    there as a client of the service would.
    """
    import asyncio

    from realizer.examples import examples

    documents = examples()
    _film(list(documents.values()), voice, face)
    asyncio.run(_serve(documents, once, port, voice, face))


def _film(documents: list[str], voice: str | None, face: str) -> None:
    """Write all examples, one after the other, to demo.fap and demo.mp4."""
    from realizer.offline import realize
    from realizer.outputs.output import RenderSettings
    from realizer.outputs.registry import output_for

    appended = [text.replace("<bml ", '<bml composition="APPEND" ', 1) for text in documents]
    realization = realize(appended, face=face, voice=voice)
    warn_no_voice(voice)
    for path in (FRAMES, FILM):
        click.echo(f"writing {path} ({realization.duration:.1f} s) ...")
        try:
            with steps("drawing") as drawn:
                output_for(path).write(realization, path, RenderSettings(drawn=drawn))
        except RealizerError as error:
            click.echo(f"realizer: {path} was left out: {error}", err=True)


def _next_steps(page: str | None) -> str:
    made = [f"{path}: {text}" for path, text in ((FILM, "the film"), (FRAMES, "its FAPs")) if path.is_file()]
    live = [f"{page}: the page, until Ctrl-C"] if page else []
    return "\n".join([*(f"made {line}" for line in made), *(f"open {line}" for line in live), NEXT])


def _line(feedback: Feedback) -> str:
    """Return a line that describes feedback, or "" for predictions."""
    from bml_schema import BlockProgress, SyncPointProgress, WarningFeedback

    match feedback:
        case BlockProgress() | SyncPointProgress():
            return f"  {feedback.global_time:8.3f} s  {feedback.id}"
        case WarningFeedback():
            return f"  warning     {feedback.id}: {feedback.type}: {feedback.text}"
    return ""


async def _serve(documents: dict[str, str], once: bool, port: int, voice: str | None, face: str) -> None:
    """Serve the page, play every example as a client would, and print its feedback."""
    from realizer.client import connect
    from realizer.server.serve import Server

    settings = Settings.read({"port": port, "voice": voice, "face": face})
    try:
        server = await Server(settings).start()
    except OSError:
        server = await Server(replace(settings, port=0)).start()
    page = f"http://{settings.host}:{server.port}/?session=demo"
    try:
        if not once:
            click.echo(f"page: {page}")
        async with connect(f"ws://{settings.host}:{server.port}/ws?session=demo") as client:
            for name, text in documents.items():
                click.echo(f"\n{name}")
                await client.send(text)
                async for feedback in client.until_end():
                    if line := _line(feedback):
                        click.echo(line)
        click.echo("\n" + _next_steps(None if once else page))
        if not once:
            await server.wait_closed()
    finally:
        await server.close()
