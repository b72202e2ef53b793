"""`study`: kits of pictures and films for judges, and the analysis of their answers."""

from __future__ import annotations

import secrets
from collections.abc import Sequence
from itertools import product
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import inputs, options
from realizer.cli.options import option
from realizer.cli.progress import counting, note

if TYPE_CHECKING:
    from realizer_studio.study.drawing import Variant

# Not imported for --help.
KINDS = ("visual", "emotional", "naming", "displacements", "films")


@click.group()
def study() -> None:
    """Make studies of faces that people judge (Wojdel 2005, 5.3.2; Paul 2010, 4.4); analyse the answers.

    \b
    realizer study make faces --kind visual --kind naming --face ada --face ben --judges 25
    realizer study judge faces -o machine.csv
    realizer study analyse answers-*.csv machine.csv --key faces.key.json -o report
    """


def _key(value: Path | None, answers: Sequence[Path]) -> Path:
    found = [value] if value else sorted({key for file in answers for key in file.parent.glob("*.key.json")})
    if len(found) != 1:
        raise click.UsageError(f"wanted --key DIR.key.json, got {len(found)} keys beside the answers")
    return found[0]


@study.command()
@click.argument("folder", metavar="DIR", type=options.OUTPUT)
@option(
    "--kind",
    "Questions; may be repeated.  [default: visual and naming]",
    click.Choice(KINDS),
    default=("visual", "naming"),
    show_default=False,
    name="kinds",
    multiple=True,
)
@option("--face NAME", "Face; several are compared.  [default: ada]", name="faces", multiple=True)
@option("--deformer", "Several are compared.", click.Choice(["mpeg4", "au"]), name="deformers", multiple=True)
@option(
    "--mapping",
    "Mapping of action units to FAPs; several are compared.",
    options.MAPPING,
    name="mappings",
    multiple=True,
)
@option(
    "--references FOLDER|FACE",
    "To compare with: photographs with labels.csv (file,aus), or a face.  [default: another face]",
    name="source",
)
@option("--judges", "Judges to come.", click.IntRange(1, 1000), default=10)
@option("--items", "Draw so many questions of each kind.  [default: all]", click.IntRange(1), name="most")
@option("--seed", "Seed of all choices.  [default: a random one, told in the key]", click.IntRange(0))
@option("--language", "First language of the page.", click.Choice(["en", "de", "pl"]), default="en")
def make(folder: Path, kinds: tuple[str, ...], judges: int, seed: int | None, **choices: Any) -> None:
    """Write DIR, which opens in any browser, and its right answers to DIR.key.json beside it.

    Hand out the folder, with a number to each judge, and keep the key. Answers come back as CSV.
    """
    from realizer_studio.study.kit import Plan, check_folder, write_kit
    from realizer_studio.tracking.network import TrackingError

    with inputs.reporting(ValueError):
        check_folder(folder)
    variants = _variants(choices.pop("faces"), choices.pop("deformers"), choices.pop("mappings"))
    plan = Plan(kinds, variants, seed=secrets.randbelow(2**32) if seed is None else seed, **choices)
    with inputs.reporting(TrackingError), counting("drawing", plan.drawn) as step:
        items = plan.items(step)
    about = {"judges": judges, "language": plan.language, "seed": plan.seed}
    with inputs.opening(folder), inputs.reporting(ValueError):
        key = write_kit(folder, items, about | {"variants": [one.name for one in variants]})
    note(f"{folder}: {len(items)} questions; open {folder / 'index.html'}; the right answers: {key}")


@study.command()
@click.argument("folder", metavar="DIR", type=options.FOLDER)
@option("-o --output FILE.csv", "Answers to write.", options.OUTPUT, required=True)
def judge(folder: Path, output: Path) -> None:
    """Answer the study in DIR by a machine, from its pictures alone; its answers are marked.

    It needs the extra `track`, and leaves out scores and films, which it cannot judge.
    """
    from realizer.core.atomic_files import write_text
    from realizer.outputs.csv_table import csv_text
    from realizer_studio.study import judge as machine
    from realizer_studio.study.answers import COLUMNS

    inputs.check_suffix(output, ".csv")
    count = len(machine.read_items(folder)["items"])
    with counting("judging", count) as step:
        rows = list(machine.judge(folder, step))
    if not rows:
        raise click.UsageError(f"{folder}: wanted questions about matching or naming, got none of them")
    with inputs.opening(output):
        write_text(output, csv_text(COLUMNS, rows))
    note(f"{output}: {len(rows)} of {count} questions answered")


@study.command()
@click.argument("files", metavar="ANSWERS.csv...", nargs=-1, required=True, type=options.FILE)
@option("--key", "Right answers.  [default: the only *.key.json beside the answers]", options.FILE)
@option("-o --output DIR", "Folder to write.", options.OUTPUT, required=True)
@option("--pictures DIR", "Folder of the study.  [default: beside the key]", options.FOLDER)
@option("--keep", "Count judges who failed attention items, too.", is_flag=True)
def analyse(
    files: tuple[Path, ...], key: Path | None, output: Path, pictures: Path | None, keep: bool
) -> None:
    """Write tables as CSV and report.html: who matched, named and scored what, with 95 % intervals.

    Judges who failed more than a quarter of their attention items are named and left out.
    """
    from realizer_studio.study.answers import inattentive, read_answers, read_key
    from realizer_studio.study.results import write_report

    key = _key(key, files)
    truths = read_key(key)
    answers = read_answers(files, truths)
    failed = inattentive(answers)
    if failed:
        named = ", ".join(f"{judge} ({group})" for group, judge in failed)
        click.echo(f"failed attention items, {'kept' if keep else 'left out'}: {named}", err=True)
    if not keep and len(failed) == len({(one.group, one.judge) for one in answers}):
        raise click.ClickException("wanted answers of a judge who passed the attention items; see --keep")
    with inputs.opening(output):
        names = write_report(output, truths, answers, pictures or key.parent / truths["folder"], keep)
    note(f"{output}: {', '.join(names)}")


def _variants(faces: Sequence[str], deformers: Sequence[str], mappings: Sequence[Path]) -> list[Variant]:
    from realizer_studio.study.drawing import Variant

    for face in faces:
        options.check_face(face)
    every = product(faces or ("ada",), deformers or (None,), mappings or (None,))
    variants = [Variant(*one) for one in every]
    if len({one.name for one in variants}) < len(variants):
        raise click.UsageError(f"wanted different names, got {', '.join(one.name for one in variants)}")
    return variants
