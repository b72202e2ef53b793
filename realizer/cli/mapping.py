"""`faces mapping`: prints a face's mapping of action units to FAPs as a file to edit."""

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
    help="Where to, instead of here: .txt in Paul's form (2010, 5.2), .csv as the table that ships.",
)
@options.mapping
def mapping(name: str, output: Path | None, mapping: Path | None) -> None:
    """Write the mapping of action units to FAPs that is in force for a face.

    What is changed in such a file can be played without more: an action unit that it names is as it says, the
    others stay. A face keeps its own as au_to_fap.txt or au_to_fap.csv in its folder.

    \b
    realizer faces mapping ada -o mine.txt
    realizer realize hello.bml -o hello.mp4 --mapping mine.txt
    """
    from realizer.face.fap_mapping import mapping_of
    from realizer.tables.mappings import FORMS, as_text, write_mapping

    if output is not None and output.suffix not in FORMS:
        raise click.BadParameter(
            f"wanted a name that ends in {' or '.join(FORMS)}, got {output}", param_hint="-o"
        )
    chosen = options.settings(mapping=mapping)
    found = mapping_of(name, chosen.mapping)
    source = f"{name}: {', then '.join(found.sources)}"
    if output is None:
        click.echo(as_text(found.rows, source), nl=False)
        return
    try:
        write_mapping(output, found.rows, source)
    except OSError as error:
        raise click.UsageError(f"{output}: {error.strerror or error}") from None
    units = len({(row.au, row.side) for row in found.rows})
    click.echo(f"{output}: {units} action units by side, {len(found.rows)} rows", err=True)
