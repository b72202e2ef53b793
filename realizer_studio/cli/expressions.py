"""`expressions`: lists the expression library and searches it."""

from __future__ import annotations

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import inputs, options
from realizer.cli.options import option
from realizer.cli.progress import note
from realizer.core.errors import TableError
from realizer_studio.cli.track import follow

if TYPE_CHECKING:
    from realizer.expressions.expression import Expression

# Least cosine of the best match; the motion of an idle head reaches 0.3.
MIN_SIMILARITY = 0.4
LEAST_SEEN = 0.15  # intensity of a tracked action unit; in single pictures lower ones are noise

sheet_output = option("-o --output SHEET.png", "Draw the expressions as well.", options.OUTPUT)


class ActionUnits(click.ParamType):  # type: ignore[type-arg]
    """The type of options for action units: converts "1,2,12L=0.5" to (AU, side) -> intensity."""

    name = "action units"

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> Any:
        from realizer.tables.lexemes import read_aus

        units: dict[tuple[int, str], float] = {}
        for part in str(value).replace("+", ",").split(","):
            match = re.fullmatch(r"\s*(?:AU)?\s*([^=\s]*)\s*(?:=\s*(\d*\.?\d+))?\s*", part, re.IGNORECASE)
            if match is None:
                self.fail(f"wanted action units such as 1,2,12L=0.5, got {part!r}", parameter, context)
            try:
                units |= read_aus({match[1].upper(): float(match[2] or 1)}, "--au")
            except TableError as error:
                self.fail(re.sub(r"^--au[:,] ", "", str(error)), parameter, context)
        return units


@click.group()
def expressions() -> None:
    """List and search the expressions that documents and timelines can use by name."""


@expressions.command("list")
@options.as_json
@sheet_output
@options.face("Face to draw", default="default", show_default=True)
@options.expressions
def list_(as_json: bool, output: Path | None, face: str, expressions: Path | None) -> None:
    """List the expressions: name, action units, seconds of onset, apex and offset, description."""
    from realizer.expressions.library import library_of

    inputs.check_suffix(output, ".png")
    library = list(library_of(inputs.settings(expressions=expressions).expressions).values())
    _print_matches(library, [""] * len(library), as_json)
    if output is not None:
        _draw(library, [expression.units for expression in library], output, face)


@expressions.command()
@click.argument("text", required=False)
@option("--au 1,2,12L=0.5", "Search by action units.", ActionUnits(), name="units")
@option(
    "--like IMAGE",
    "Search by a picture of a face: one that this program drew from the front, or any other.",
    options.FILE,
)
@option("--limit", "Largest number of results.", click.IntRange(1), default=8)
@options.as_json
@sheet_output
@option(
    "--face NAME",
    "Face to draw; also the built-in face in the picture of --like.  [default: default; any with --like]",
)
@options.expressions
def find(text: str | None, units: Any, like: Path | None, output: Path | None, **choices: Any) -> int:
    """Search expressions by the words of TEXT, by action units or by a picture, best match first.

    Exits with 1 if nothing matches.

    \b
    realizer expressions find "sorry about that"
    realizer expressions find --au 1,2,12L -o found.png
    realizer expressions find --like face.png
    """
    from realizer.expressions.library import library_of
    from realizer_studio.analysis.expression_search import by_action_units, by_meaning

    if sum(query is not None for query in (text, units, like)) != 1:
        raise click.UsageError("wanted one of TEXT, --au and --like")
    inputs.check_suffix(output, ".png")
    library = list(library_of(inputs.settings(expressions=choices["expressions"]).expressions).values())
    face: str | None = choices["face"]
    if text is not None:
        matches = by_meaning(text, library)
    elif units is not None:
        matches = by_action_units(units, library)
    else:
        assert like is not None
        face, matches = _like(like, library, face)
    matches = matches[: choices["limit"]]
    matching, scores = [match[0] for match in matches], [f"{match[1]:.2f}" for match in matches]
    _print_matches(matching, scores, choices["as_json"])
    if not matches:
        query_text = repr(text) if text is not None else "this query"
        click.echo(f"no expression matches {query_text}; see `realizer expressions list`", err=True)
    elif output is not None:
        _draw(matching, scores, output, face or "default")
    return 0 if matches else 1


def _like(
    path: Path, library: Sequence[Expression], face: str | None
) -> tuple[str | None, list[tuple[Expression, float]]]:
    """Return the shipped face in a picture, or None, and the expressions, best match first."""
    from realizer_studio.analysis.picture_search import UnknownPictureError, by_picture, read_picture

    with inputs.reporting(UnknownPictureError):
        picture = read_picture(path)
        try:
            found = by_picture(picture, library, None if face is None else [face])
        except UnknownPictureError:
            if face is not None:
                raise
            return None, _tracked(path, library)
    note(f"{path}: {found.face}, {found.light}{', neutral' if found.neutral else ''}")
    matches = [match for match in found.matches if match[1] > 0]
    return found.face, matches if matches and matches[0][1] >= MIN_SIMILARITY else []


def _tracked(path: Path, library: Sequence[Expression]) -> list[tuple[Expression, float]]:
    """Return the expressions with the action units that are tracked in a picture, best match first."""
    from realizer.tables.lexemes import read_aus
    from realizer_studio.analysis.expression_search import by_action_units
    from realizer_studio.tracking.network import TrackingError
    from realizer_studio.tracking.person_recording import record
    from realizer_studio.tracking.regressor import MEASURED_UNITS

    with inputs.reporting(TrackingError):
        times, people = follow(path, None)
    values = record(people[0], times, 25.0).units[0]
    units = {
        unit: round(float(value), 2)
        for unit, value in zip(MEASURED_UNITS, values, strict=True)
        if value >= LEAST_SEEN
    }
    text = ", ".join(f"{unit}={value}" for unit, value in units.items())
    note(f"{path}: none of our faces; action units {text or 'at rest'}")
    return by_action_units(read_aus(units, str(path)), library)


def _print_matches(expressions: Sequence[Expression], scores: Sequence[str], as_json: bool) -> None:
    """Print expressions with the scores of a search; a score is "" in a plain list."""
    scored = list(zip(expressions, scores, strict=True))
    if as_json:
        rows = [e.to_json() | ({"score": float(score)} if score else {}) for e, score in scored]
        click.echo(json.dumps(rows, indent=1))
        return
    name_width = max((len(e.name) for e in expressions), default=0)
    units_width = max((len(e.units) for e in expressions), default=0)
    for e, score in scored:
        head = f"{score + '  ' if score else ''}{e.name:<{name_width}}  {e.units:<{units_width}}"
        file = f"  [{e.file}]" if e.file is not None else ""
        seconds = f"{e.onset:4.2f} {e.apex:4.2f} {e.offset:4.2f}"
        click.echo(f"{head}  {seconds}  {e.features or ', '.join(e.means)}{file}".rstrip())


def _draw(expressions: Sequence[Expression], notes: Sequence[str], path: Path, face: str) -> None:
    from PIL import Image

    from realizer_studio.cli.sheet_poses import draw_expressions

    Image.fromarray(draw_expressions(expressions, notes, face)).save(path)
    note(f"{path}: {len(expressions)} expressions")
