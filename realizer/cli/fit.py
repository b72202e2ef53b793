"""`faces fit`: fits the action unit model of a face to measurements."""

from __future__ import annotations

from pathlib import Path

import click

from realizer.cli import options
from realizer.core.errors import FaceError

SHAPES = "au_shapes.npz"
FORMS = ("published", "extended")


@click.command()
@click.argument("name")
@click.option(
    "--from",
    "measurements",
    type=options.FILE,
    help="Fit to measured landmarks: a CSV file with lines # source:, # units:, # licence: and the columns "
    "au,x,y,z,dx,dy,dz in metres; one side is enough.  [default: the face's own shapes]",
)
@click.option(
    "--data",
    type=options.FOLDER,
    help="Measure the shapes in this folder of the unpacked CC0 head data, and save them with the face.",
)
@click.option(
    "--form",
    type=click.Choice([*FORMS, "both"]),
    help="One or two Gaussians (published), or up to four (extended).  [default: both; extended for a FILE]",
)
@click.option(
    "-o",
    "--output",
    metavar="FOLDER|FILE.toml",
    type=options.OUTPUT,
    help="Folder for au_FORM.toml, or the file of one form.  [default: the face's folder]",
)
def fit(
    name: str, measurements: Path | None, data: Path | None, form: str | None, output: Path | None
) -> None:
    """Fit the action unit model of a face, and print its errors (Wojdel 2005, table 4.3).

    --deformer au draws a face with the extended form. After `realizer faces build`, use --data to measure the
    new shapes.
    """
    import os

    # Thousands of small matrix products: further threads only slow them down.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    from realizer.face.au.file import write_model
    from realizer.face.load import folder_of, load_face
    from realizer.facebuild.au.fit import fit_models, table, table_text
    from realizer.facebuild.au.fit_limits import runaways
    from realizer.facebuild.au.measure import read_measurements, read_shapes, write_shapes

    if measurements and data:
        raise click.UsageError("wanted --from or --data, got both")
    folder, face = folder_of(name), load_face(name, deformer="mpeg4")
    files = _files(output or folder, form)
    source = face.source
    if data:
        from realizer.facebuild.au.shapes import measure_shapes

        measured = measure_shapes(face, folder, data)
    elif measurements:
        measured, source = read_measurements(measurements), f"measured landmarks, {measurements.name}"
    elif (folder / SHAPES).is_file():
        measured = read_shapes(folder / SHAPES)
    else:
        raise FaceError(
            f"{folder / SHAPES}: wanted this face's own shapes, found none; "
            "give landmarks with --from, or the data it was built from with --data"
        )
    done = 0

    def report(text: str) -> None:
        nonlocal done
        done += 1
        options.note(f"{done}/{len(measured)} {text}")

    models = fit_models(face, measured, tuple(files), report, source)
    faults = [
        f"{kind}: {fault}" for kind, model in models.items() for fault in runaways(face, model, measured)
    ]
    if faults:
        raise FaceError("; ".join((f"{folder}: nothing written, a fit tears the face", *faults)))
    if data:
        write_shapes(folder / SHAPES, measured)
    for kind, model in models.items():
        write_model(files[kind], model)
        click.echo(f"{kind} form\n{table_text(table(model, measured))}")
        options.note(f"{files[kind]}: written")


def _files(output: Path, form: str | None) -> dict[str, Path]:
    if output.suffix == ".toml":
        if form == "both":
            raise click.BadParameter(f"wanted a folder for two forms, got {output}", param_hint="-o")
        return {form or "extended": output}
    if not output.is_dir():
        raise click.BadParameter(f"wanted a folder that exists, or FILE.toml, got {output}", param_hint="-o")
    return {kind: output / f"au_{kind}.toml" for kind in FORMS if form in (None, "both", kind)}
