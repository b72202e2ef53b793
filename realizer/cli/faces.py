"""`faces`: lists faces, and writes how action units move their FAPs."""

from pathlib import Path

import click

from realizer.cli import inputs, options
from realizer.cli.command_group import FaceCommands
from realizer.cli.options import option
from realizer.cli.progress import note


@click.group(cls=FaceCommands)
def faces() -> None:
    """List, draw, check, import and build faces.

    A face is a folder; the built-in ones are used by name. Your own are looked up in the folder that
    the variable REALIZER_FACES names.
    """


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
@click.argument("name", default="default", shell_complete=options.completing_faces)
@option(
    "-o --output FILE",
    "Write a .txt file in the format of Paul (2010, 5.2) or a .csv file.  [default: print the former]",
    click.Path(dir_okay=False, path_type=Path),
)
@options.mapping
def mapping(name: str, output: Path | None, mapping: Path | None) -> None:
    """Write how action units move the FAPs of a face, as a file to edit.

    The edited file works with --mapping of other commands: action units in it move as it says, all others
    as before. To change a face for good, save it as au_to_fap.txt or au_to_fap.csv in the face's folder.

    \b
    realizer faces mapping ada -o mine.txt
    realizer realize hello.bml -o hello.mp4 --mapping mine.txt
    """
    from realizer.face.fap_mapping import mapping_of
    from realizer.tables.mappings import FORMS, as_text, write_mapping

    inputs.check_suffix(output, *FORMS)
    chosen = mapping_of(name, inputs.settings(mapping=mapping).mapping)
    source = f"{name}: {', then '.join(chosen.sources)}"
    if output is None:
        click.echo(as_text(chosen.rows, source), nl=False)
        return
    with inputs.opening(output):
        write_mapping(output, chosen.rows, source)
    units = len({(row.au, row.side) for row in chosen.rows})
    note(f"{output}: {units} action units by side, {len(chosen.rows)} rows")
