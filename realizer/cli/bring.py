"""`faces import`: a GLB head with ARKit's shapes becomes a face folder."""

from __future__ import annotations

from pathlib import Path

import click

__all__: list[str] = []


@click.command("import")
@click.argument("head", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option("--name", help="The face's name; default the output folder's, or the file's.")
@click.option(
    "-o", "--output", type=click.Path(path_type=Path), help="The folder to write; default faces/NAME."
)
def import_(head: Path, name: str | None, output: Path | None) -> None:
    """Make a face of a GLB or glTF head with ARKit-named morph targets (jawOpen, mouthSmileLeft, ...).

    Prints what was found, what is missing, and what to look at.
    """
    from realizer.face.arkit import import_head

    folder = output or Path("faces") / (name or head.stem)
    for line in import_head(head, folder, name or folder.name).lines:
        click.echo(line)
    click.echo(
        f"{folder}: written; look at it: realizer faces sheet {folder.name} -o {folder.name}.png", err=True
    )
