"""`faces import` and `faces check`: imports a head; reports what is wrong with a face."""

from __future__ import annotations

from pathlib import Path

import click

HEADS = (".glb", ".gltf")


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
    from realizer.facebuild.arkit.importer import import_head

    folder = output or Path("faces") / (name or head.stem)
    for line in import_head(head, folder, name or folder.name).lines:
        click.echo(line)
    click.echo(
        f"{folder}: written; look at it: realizer faces sheet {folder.name} -o {folder.name}.png", err=True
    )


@click.command()
@click.argument("names", nargs=-1, metavar="[NAME | FOLDER | HEAD.glb]...")
def check(names: tuple[str, ...]) -> int:
    """Say every fault of face folders, of all without a name; of a GLB head, what an import would find."""
    from realizer.face.load import face_folders
    from realizer.facebuild.check import check_face

    status = 0
    for name in names or face_folders():
        head = Path(name)
        if head.suffix.lower() in HEADS:
            faults = _head_faults(head)
        elif head.name != name and head.is_dir():
            folder = head.resolve()
            faults = check_face(folder.name, folder.parent)
        else:
            faults = check_face(name)
        for fault in faults:
            click.echo(fault)
        if not faults:
            click.echo(f"{name}: sound", err=True)
        status = 1 if faults else status
    return status


def _head_faults(head: Path) -> tuple[str, ...]:
    """Why a head cannot be imported; else says what an import finds."""
    from realizer.core.errors import FaceError
    from realizer.facebuild.arkit.importer import inspect_head

    try:
        for line in inspect_head(head).lines:
            click.echo(line)
    except FaceError as error:
        return (str(error),)
    return ()
