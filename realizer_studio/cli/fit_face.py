"""`faces fit`: fits the action unit model of a face."""

from itertools import count
from pathlib import Path

import click

from realizer.cli import options
from realizer.cli.options import option
from realizer.cli.progress import note, steps
from realizer.core.errors import FaceError

SHAPES = "au_shapes.npz"
FORMS = ("published", "extended")


@click.command("fit")
@click.argument("name", shell_complete=options.completing_faces)
@option(
    "--from",
    "Fit to measured landmarks: a CSV file with lines # source:, # units:, # licence: and the columns "
    "au,x,y,z,dx,dy,dz in metres; one side is enough.  [default: the face's own shapes]",
    options.FILE,
    name="measurements",
)
@option(
    "--data",
    "Measure the shapes in this folder of the unpacked CC0 head data, and save them with the face.",
    options.FOLDER,
)
@option(
    "--form",
    "One or two Gaussians (published), or up to four (extended).  [default: both; extended for a FILE]",
    click.Choice([*FORMS, "both"]),
)
@option(
    "-o --output FOLDER|FILE.toml",
    "Folder for au_FORM.toml, or the file of one form.  [default: the face's folder]",
    options.OUTPUT,
)
def fit_face(
    name: str, measurements: Path | None, data: Path | None, form: str | None, output: Path | None
) -> None:
    """Fit the action unit model of a face, and print its errors (Wojdel 2005, table 4.3).

    --deformer au draws a face with the extended form. After `realizer faces build`, use --data to measure the
    new shapes.
    """
    from realizer.face.load import folder_of, load_face
    from realizer_studio.faces.au.fit_limits import runaways
    from realizer_studio.faces.au.measure import read_measurements, read_shapes, write_shapes
    from realizer_studio.faces.au.model_file import write_model
    from realizer_studio.faces.au.unit_fit import fit_models, left_out_text, table, table_text

    if measurements and data:
        raise click.UsageError("wanted --from or --data, got both")
    folder, face = folder_of(name), load_face(name, deformer="mpeg4")
    files = _files(output or folder, form)
    source = face.source
    if data:
        from realizer_studio.faces.au.shapes import measure_shapes

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
    with steps("fitting") as show:
        done = count(1)
        models = fit_models(
            face,
            measured,
            tuple(files),
            lambda text: show(at := next(done), len(measured), f"{at}/{len(measured)} {text}"),
            source,
        )
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
        note(f"{files[kind]}: written")
    if measurements:
        click.echo(left_out_text(face, measured, models))


def _files(output: Path, form: str | None) -> dict[str, Path]:
    if output.suffix == ".toml":
        if form == "both":
            raise click.BadParameter(f"wanted a folder for two forms, got {output}", param_hint="-o")
        return {form or "extended": output}
    if not output.is_dir():
        raise click.BadParameter(f"wanted a folder that exists, or FILE.toml, got {output}", param_hint="-o")
    return {kind: output / f"au_{kind}.toml" for kind in FORMS if form in (None, "both", kind)}
