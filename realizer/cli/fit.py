"""`faces fit`: fits the action unit model of a face to measurements."""

from __future__ import annotations

from pathlib import Path

import click

from realizer.core.errors import FaceError

SHAPES = "au_shapes.npz"
FORMS = ("published", "extended")


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
@click.option(
    "--form",
    type=click.Choice([*FORMS, "both"]),
    help="published: one or two Gaussians; extended: up to four.  [default: both; extended for a FILE]",
)
@click.option("-o", "--output", metavar="FOLDER|FILE.toml", type=click.Path(path_type=Path),
              help="Where au_FORM.toml goes, or one form's file.  [default: the face's folder]")  # fmt: skip
@click.pass_context
def fit(
    context: click.Context,
    name: str,
    measurements: Path | None,
    data: Path | None,
    form: str | None,
    output: Path | None,
) -> None:
    """Fit how action units move a face, and print how near it comes (Wojdel 2005, table 4.3).

    The deformer au draws a face by the extended form. A face that was built anew is measured anew by --data.
    """
    import os

    # Small products, thousands of them: a second thread only costs.
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

    def say(words: str) -> None:
        nonlocal done
        done += 1
        if not (context.obj or {}).get("quiet"):
            click.echo(f"{done}/{len(measured)} {words}", err=True)

    models = fit_models(face, measured, tuple(files), say, source)
    faults = [
        f"{kind}: {words}" for kind, model in models.items() for words in runaways(face, model, measured)
    ]
    if faults:
        raise FaceError("; ".join((f"{folder}: nothing written, a fit tears the face", *faults)))
    if data:
        write_shapes(folder / SHAPES, measured)
    for kind, model in models.items():
        write_model(files[kind], model)
        click.echo(f"{kind} form\n{table_text(table(model, measured))}")
        click.echo(f"{files[kind]}: written", err=True)


def _files(output: Path, form: str | None) -> dict[str, Path]:
    """Form -> the file that it goes to."""
    if output.suffix == ".toml":
        if form == "both":
            raise click.BadParameter(f"wanted a folder for two forms, got {output}", param_hint="-o")
        return {form or "extended": output}
    if not output.is_dir():
        raise click.BadParameter(
            f"wanted a folder that is there, or FILE.toml, got {output}", param_hint="-o"
        )
    return {kind: output / f"au_{kind}.toml" for kind in FORMS if form in (None, "both", kind)}
