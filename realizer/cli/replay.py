"""`replay`: plays a recorded session again."""

from __future__ import annotations

from pathlib import Path

import click

from realizer.cli import options
from realizer.cli.realize import PICTURES


@click.command()
@click.argument("record", type=click.Path(exists=True, path_type=Path))
@click.option("-o", "--output", metavar="OUT", help="Where to; its suffix picks the encoding.")
@click.option("--fps", type=options.Number(0, 240, min_open=True), help="Frames a second.")
@click.option("--face", metavar="NAME", help="Another face than it had.")
@click.option("--voice", metavar="NAME", help="Another voice than it had.")
@click.option("--at", type=options.Number(0), metavar="SECONDS", help="With .png: the picture of an instant.")
@click.option("--size", default="512x512", show_default=True, callback=options.size, help="Of pictures.")
@click.option("--camera", default="front", show_default=True, help=options.CAMERAS)
@options.light
@options.background
@click.pass_context
def replay(
    context: click.Context,
    record: Path,
    output: str | None,
    fps: float | None,
    face: str | None,
    voice: str | None,
    at: float | None,
    size: tuple[int, int],
    camera: str,
    light: str | None,
    background: str | None,
) -> int:
    """Play a session again that `serve --record DIR` wrote.

    RECORD is a file, or a folder that has one. Prints its feedback, or writes frames, pictures, sound or a
    film of it, as they were live. Everything is done at its own time, without a clock: what went wrong once
    goes wrong again, so a record is the best report of a fault.
    """
    from realizer.outputs.output import RenderSettings
    from realizer.outputs.registry import output_for
    from realizer.server.journal import JournalError
    from realizer.server.journal.playback import replay_feedback, replay_recording
    from realizer.server.journal.recordings import read_record

    writer = None
    if output is not None:
        try:
            writer = output_for(Path(output))
        except ValueError as error:
            raise click.BadParameter(str(error), param_hint="-o") from None
    changed = {"fps": fps, "face": face, "voice": voice}
    try:
        found = read_record(record)
        if writer is None or output is None:
            for text in replay_feedback(found, **changed):
                click.echo(text)
            return 0
        realization, _ = replay_recording(found, **changed)
    except JournalError as error:  # of the file: nothing is missing here
        raise click.ClickException(str(error)) from None
    if writer.suffix in PICTURES:
        options.check_camera(realization.face_name, camera)
    drawing = RenderSettings(size=size, camera=camera, at=at, light=light, background=background)
    drawing = writer.begin(drawing, realization.face_name, realization.deformer)
    try:
        writer.write(realization, Path(output), drawing)
    except OSError as error:
        raise click.UsageError(f"{output}: {error.strerror or error}") from None
    if not context.obj["quiet"]:
        words = f"{output}: {realization.duration:.2f} s, {realization.frames} frames"
        click.echo(f"{words} at {realization.fps:g} fps", err=True)
    return 0
