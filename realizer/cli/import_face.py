"""`faces import` and `faces check`: import a head, and report faults of faces."""

from __future__ import annotations

from pathlib import Path

import click

from realizer.cli import options

HEADS = (".glb", ".gltf")


@click.command("import")
@click.argument("head", type=options.FILE)
@click.option("--name", help="Name of the face.  [default: that of the output folder, or of the file]")
@click.option("-o", "--output", type=options.OUTPUT, help="Folder to write.  [default: faces/NAME]")
def import_(head: Path, name: str | None, output: Path | None) -> None:
    """Make a face folder from a GLB or glTF head with ARKit blend shapes (jawOpen, mouthSmileLeft, ...).

    Prints what the file has, what is missing, and what to check by eye.

    \b
    realizer faces import anna.glb
    realizer faces sheet anna -o anna.png
    """
    from realizer.facebuild.arkit.importer import import_head

    folder = output or Path("faces") / (name or head.stem)
    for line in import_head(head, folder, name or folder.name).lines:
        click.echo(line)
    options.note(f"{folder}: written; look at it: realizer faces sheet {folder.name} -o {folder.name}.png")


@click.command()
@click.argument("names", nargs=-1, metavar="[NAME | FOLDER | HEAD.glb]...")
def check(names: tuple[str, ...]) -> int:
    """Print every fault of face folders; without a name, of all of them.

    For a GLB or glTF head, prints what `realizer faces import` would find.
    """
    from realizer.face.load import face_folders
    from realizer.facebuild.check import check_face

    status = 0
    for name in names or face_folders():
        path = Path(name)
        if path.suffix.lower() in HEADS:
            faults = _inspect_head(path)
        elif path.name != name and path.is_dir():
            folder = path.resolve()
            faults = check_face(folder.name, folder.parent)
        else:
            faults = check_face(name)
        for fault in faults:
            click.echo(fault)
            status = 1
        if not faults:
            options.note(f"{name}: sound")
    return status


def _inspect_head(head: Path) -> tuple[str, ...]:
    """Print what an import would find, or return why the head cannot be imported."""
    from realizer.core.errors import FaceError
    from realizer.facebuild.arkit.importer import inspect_head

    try:
        for line in inspect_head(head).lines:
            click.echo(line)
    except FaceError as error:
        return (str(error),)
    return ()
