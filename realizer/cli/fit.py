"""`faces fit`: the action unit model of a face, fitted to measurements or to the face's own shapes."""

from __future__ import annotations

from pathlib import Path

import click

from realizer.errors import FaceError

__all__: list[str] = []

SHAPES = "au_shapes.npz"


@click.command()
@click.argument("name")
@click.option(
    "--from",
    "measurements",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Measured landmarks: a CSV file au,x,y,z,dx,dy,dz in metres, below lines # source:, # units: and "
    "# licence:; one side is enough. Default: the face's own shapes.",
)
@click.option(
    "--data",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    help="Folder of the unpacked CC0 head data: take the shapes from there, keep them in the face's folder.",
)
@click.option("--form", type=click.Choice(["published", "extended"]), default="extended", show_default=True,
              help="published: one or two Gaussians; extended: up to four.")  # fmt: skip
@click.option("-o", "--output", required=True, metavar="FILE.toml", type=click.Path(path_type=Path))
def fit(name: str, measurements: Path | None, data: Path | None, form: str, output: Path) -> None:
    """Fit how action units move a face, and print how near it comes (Wojdel 2005, table 4.3)."""
    import os

    # Small products, thousands of them: a second thread only costs.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from realizer.face import load_face
    from realizer.face.au import (
        fit_model,
        read_measured,
        read_shapes,
        table,
        table_text,
        write_model,
        write_shapes,
    )
    from realizer.face.load import folder_of

    if measurements and data:
        raise click.UsageError("wanted --from or --data, got both")
    folder, face = folder_of(name), load_face(name)
    source = face.source
    if data:
        from realizer.face.au.shapes import measure_shapes

        measured = measure_shapes(face, folder, data)
        write_shapes(folder / SHAPES, measured)
    elif measurements:
        measured, source = read_measured(measurements), f"measured landmarks, {measurements.name}"
    elif (folder / SHAPES).is_file():
        measured = read_shapes(folder / SHAPES)
    else:
        raise FaceError(
            f"{folder / SHAPES}: wanted this face's own shapes, found none; "
            "give landmarks with --from, or the data it was built from with --data"
        )
    done = 0

    def say(words: str) -> None:
        nonlocal done
        done += 1
        click.echo(f"{done}/{len(measured)} {words}", err=True)

    model = fit_model(face, measured, form, say, source)
    write_model(output, model)
    click.echo(table_text(table(model, measured)))
    click.echo(f"{output}: written", err=True)
