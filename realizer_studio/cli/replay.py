"""`replay`: plays a recorded session again."""

from pathlib import Path
from typing import Any

import click

from realizer.cli import inputs, options
from realizer.cli.options import option
from realizer.cli.realize import PICTURES, save, writer_for


@click.command()
@click.argument("record", type=click.Path(exists=True, path_type=Path))
@option("-o --output OUT", "File to write, in the format of its suffix.  [default: print the feedback]")
@option("--fps", "Frames per second.  [default: that of the session]", options.Number(0, 240, min_open=True))
@options.face("Face instead of the recorded one")
@option("--voice NAME", "Replace the voice.")
@options.at
@options.size
@options.camera
@options.light
@options.background
def replay(record: Path, output: str | None, **flags: Any) -> None:
    """Play a session again that `realizer serve --record DIR` recorded.

    RECORD is a recording, or a folder with a single one. Prints the feedback, or writes what the session
    showed. All messages are played at their recorded times, without a clock, so faults happen again: attach
    the recording to a bug report.

    \b
    realizer replay records/
    realizer replay records/ -o session.mp4
    """
    from realizer.outputs.output import RenderSettings
    from realizer.server.journal import JournalError
    from realizer.server.journal.recordings import read_recording
    from realizer_studio.recorded_sessions import replay_feedback, replay_recording

    writer = writer_for(output)
    changes = {name: flags.pop(name) for name in ("fps", "face", "voice")}
    with inputs.reporting(JournalError, wrong=click.ClickException):
        recording = read_recording(record)
        if writer is None or output is None:
            for text in replay_feedback(recording, **changes):
                click.echo(text)
            return
        realization, _ = replay_recording(recording, **changes)
    drawing = RenderSettings(**flags)
    if writer.suffix in PICTURES:
        options.check_camera(realization.face_name, drawing.camera)
    drawing = writer.begin(drawing, realization.face_name, realization.deformer)
    save(realization, writer, Path(output), drawing)
