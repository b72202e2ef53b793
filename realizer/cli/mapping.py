"""`faces mapping`: writes a face's mapping of action units to FAPs as a file to edit."""

from __future__ import annotations

from pathlib import Path

import click

from realizer.cli import options


@click.command()
@click.argument("name", default="default")
@click.option(
    "-o",
    "--output",
    metavar="FILE",
    type=click.Path(dir_okay=False, path_type=Path),
    help="Write a .txt file in the format of Paul (2010, 5.2) or a .csv file.  [default: print the former]",
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

    options.check_suffix(output, *FORMS)
    chosen = mapping_of(name, options.settings(mapping=mapping).mapping)
    source = f"{name}: {', then '.join(chosen.sources)}"
    if output is None:
        click.echo(as_text(chosen.rows, source), nl=False)
        return
    with options.writing(output):
        write_mapping(output, chosen.rows, source)
    units = len({(row.au, row.side) for row in chosen.rows})
    options.note(f"{output}: {units} action units by side, {len(chosen.rows)} rows")
