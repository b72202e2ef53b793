"""`expressions`: lists the expression library and searches it."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import options

if TYPE_CHECKING:
    from realizer.analysis.picture_search import Likeness
    from realizer.expressions.expression import Expression

MIN_LIKE = 0.4  # the best cosine of a picture that shows anything: a head that idles makes 0.3
as_json = click.option("--json", "as_json", is_flag=True, help="As JSON instead of lines.")
picture = click.option(
    "-o", "--output", metavar="SHEET.png", type=click.Path(path_type=Path), help="Draw what is told."
)
face = click.option("--face", default="default", show_default=True, help="Whose face.")
whose = click.option("--face", metavar="NAME", help="Whose face; --like takes any, else the default one.")


class Units(click.ParamType):  # type: ignore[type-arg]
    """1,2,12L=0.5 -> (AU, side) -> intensity."""

    name = "units"

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> Any:
        from realizer.core.errors import TableError
        from realizer.tables.lexemes import read_aus

        found: dict[tuple[int, str], float] = {}
        for part in str(value).replace("+", ",").split(","):
            match = re.fullmatch(r"\s*(?:AU)?\s*([^=\s]*)\s*(?:=\s*(\d*\.?\d+))?\s*", part, re.IGNORECASE)
            if match is None:
                self.fail(f"wanted action units such as 1,2,12L=0.5, got {part!r}", parameter, context)
            try:
                found |= read_aus({match[1].upper(): float(match[2] or 1)}, "--au")
            except TableError as error:
                self.fail(re.sub(r"^--au[:,] ", "", str(error)), parameter, context)
        return found


@click.group()
def expressions() -> None:
    """List the expressions that documents and timelines may name, and look them up."""


@expressions.command("list")
@as_json
@picture
@face
@options.expressions
def list_(as_json: bool, output: Path | None, face: str, expressions: Path | None) -> None:
    """A line for each: name, action units, seconds of onset, apex and offset, and what is seen."""
    from realizer.expressions.library import library_of

    _check_picture(output, face)
    known = list(library_of(options.settings(expressions=expressions).expressions).values())
    _print_matches(known, [""] * len(known), as_json)
    if output is not None:
        _draw(known, [one.units for one in known], output, face)


@expressions.command()
@click.argument("text", required=False)
@click.option("--au", "units", type=Units(), metavar="1,2,12L=0.5", help="By action units, instead of words.")
@click.option(
    "--like",
    metavar="IMAGE",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="By a picture of one of our faces from the front, in any of our lights.",
)
@click.option("--most", type=click.IntRange(1), default=8, show_default=True, help="How many to tell.")
@as_json
@picture
@whose
@options.expressions
def find(
    text: str | None,
    units: Any,
    like: Path | None,
    most: int,
    as_json: bool,
    output: Path | None,
    face: str | None,
    expressions: Path | None,
) -> int:
    """Look expressions up: by what TEXT says they mean, by action units, by a picture; the best first.

    \b
    realizer expressions find "sorry about that"
    realizer expressions find --au 1,2,12L -o found.png
    realizer expressions find --like face.png
    """
    from realizer.expressions.library import library_of
    from realizer.expressions.search import by_action_units, by_meaning

    if sum(way is not None for way in (text, units, like)) != 1:
        raise click.UsageError("wanted one of TEXT, --au and --like")
    _check_picture(output, face or "default")
    known = list(library_of(options.settings(expressions=expressions).expressions).values())
    if text is not None:
        found = by_meaning(text, known)
    elif units is not None:
        found = by_action_units(units, known)
    else:
        assert like is not None
        seen = _find_similar(like, known, face)
        face, found = seen.face, [pair for pair in seen.matches if pair[1] > 0]
        if found and found[0][1] < MIN_LIKE:
            found = []
        click.echo(f"{like}: {seen.face}, {seen.light}{', neutral' if seen.neutral else ''}", err=True)
    found = found[:most]
    scores = [f"{score:.2f}" for _, score in found]
    _print_matches([one for one, _ in found], scores, as_json)
    if not found:
        asked = repr(text) if text is not None else "that"
        click.echo(f"nothing in the library goes with {asked}; `realizer expressions list` has all", err=True)
    elif output is not None:
        _draw([one for one, _ in found], scores, output, face or "default")
    return 0 if found else 1


def _find_similar(like: Path, known: Sequence[Expression], face: str | None) -> Likeness:
    from realizer.analysis.picture_search import UnknownPictureError, by_picture, read_picture

    try:
        return by_picture(read_picture(like), known, None if face is None else [face])
    except UnknownPictureError as error:
        raise click.UsageError(str(error)) from None


def _check_picture(output: Path | None, face: str) -> None:
    if output is not None and output.suffix.lower() != ".png":
        raise click.UsageError(f"{output}: wanted a name that ends in .png")
    if output is not None:
        options.check_camera(face, "close")


def _print_matches(found: Sequence[Expression], scores: Sequence[str], as_json: bool) -> None:
    if as_json:
        told = [
            one.to_json() | ({"score": float(score)} if score else {})
            for one, score in zip(found, scores, strict=True)
        ]
        click.echo(json.dumps(told, indent=1))
        return
    width = max((len(one.name) for one in found), default=0)
    units = max((len(one.units) for one in found), default=0)
    for one, score in zip(found, scores, strict=True):
        seconds = f"{one.onset:4.2f} {one.apex:4.2f} {one.offset:4.2f}"
        own = f"  [{one.file}]" if one.file is not None else ""
        line = f"{score + '  ' if score else ''}{one.name:<{width}}  {one.units:<{units}}  {seconds}"
        click.echo(f"{line}  {one.features or ', '.join(one.means)}{own}".rstrip())


def _draw(found: Sequence[Expression], notes: Sequence[str], path: Path, face: str) -> None:
    """A picture of each on a sheet."""
    from PIL import Image

    from realizer.animation.pose import poses
    from realizer.cli.sheet_poses import Series, frames, of_expressions
    from realizer.face.fap_mapping import mapping_of
    from realizer.face.load import input_names
    from realizer.render import Renderer
    from realizer.render.contact_sheet import sheet

    rows = poses(frames([Series("", of_expressions(found))]), input_names(face), mapping_of(face))
    with Renderer(face, (220, 220), "close") as renderer:
        pictures = renderer.draw(rows)
    Image.fromarray(sheet(list(pictures), [one.name for one in found], [(note,) for note in notes])).save(
        path
    )
    click.echo(f"{path}: {len(found)} expressions", err=True)
