"""`corpus`: recordings of people become labelled segments, statistics, rules and profiles."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from realizer.cli import options

folder = click.argument("folder", metavar="DIR", type=options.FOLDER)


@click.group()
def corpus() -> None:
    """Learn from recordings of people (Wojdel 2005, chapters 6 and 7).

    \b
    realizer corpus init films
    realizer corpus add films anna --person anna --mood anxiety anna.csv anna.eaf
    realizer corpus learn films
    realizer corpus find films
    realizer corpus describe films
    realizer enrich "Are you sure?" --knowledge films/report
    """


@corpus.command()
@click.argument("folder", metavar="DIR", type=options.OUTPUT)
def init(folder: Path) -> None:
    """Make an empty corpus."""
    from realizer.core.atomic_files import write_text
    from realizer.corpus.recording import CORPUS

    if (folder / CORPUS).exists():
        raise click.UsageError(f"{folder}: wanted a new folder, got a corpus")
    folder.mkdir(parents=True, exist_ok=True)
    write_text(folder / CORPUS, "version = 1\n")
    options.note(
        f"{folder}: a corpus without recordings; add some by `realizer corpus add {folder} NAME FILE`"
    )


@corpus.command()
@folder
@click.argument("name")
@click.argument("files", nargs=-1, type=options.FILE)
@click.option("--person", help="Who is recorded; the speaker of that name, or `subject`, is this person.")
@click.option("--mood", help="Mood of the person; several by commas.")
@click.option("--fragment", help="Name of the fragment or scene in tables.  [default: NAME]")
@click.option("--language", metavar="TAG", help="Language of the words, as a BCP-47 tag.")
@click.option("--licence", help="Licence of the recording.")
@click.option(
    "--fps", type=options.Number(1, 1000), help="Frames per second.  [default: of the files, or 25]"
)
@click.option("--frames", type=click.IntRange(1, 1_000_000), help="Frames, if more than files tell.")
def add(folder: Path, name: str, files: tuple[Path, ...], **facts: Any) -> None:
    """Add a recording NAME, or more FILES of it: FAPs, points, labels and words.

    A FILE is .csv (our labels, words, FAPs or points, OpenFace, Live Link), .eaf of ELAN, .TextGrid of Praat,
    or .json (MediaPipe, or words of `realizer align`). A tier `words` or `words SPEAKER` has words; any other
    has the labels of the annotator of its name.
    """
    from realizer.corpus import recording as recordings
    from realizer.corpus.formats import merged, read_part

    if not (folder / recordings.CORPUS).is_file():
        raise click.UsageError(f"{folder}: wanted a corpus; make one by `realizer corpus init {folder}`")
    path = folder / name
    if Path(name).name != name or name.startswith("."):
        raise click.UsageError(f"wanted a name without / for the recording, got {name!r}")
    found = recordings.Recording(name)
    if (path / recordings.META).is_file():
        found = recordings.read_recording(path)
    for file in files:
        found = merged(found, read_part(file))
    found = replace(
        found, meta={**found.meta, **{key: fact for key, fact in facts.items() if fact is not None}}
    )
    recordings.write_recording(path, found)
    options.note(
        f"{path}: {found.frames} frames, {len(found.labels)} labels, {len(found.words)} words"
        f"{', FAPs' * (found.faps is not None)}{', points' * (found.points is not None)}"
    )


@corpus.command()
@folder
@click.argument("name")
@click.option(
    "-o", "--output", required=True, metavar="FILE", type=options.OUTPUT, help=".eaf, .TextGrid or .csv"
)
def export(folder: Path, name: str, output: Path) -> None:
    """Write the labels and words of a recording for ELAN, Praat, or as a table of labels."""
    from realizer.corpus.formats import write_annotations
    from realizer.corpus.recording import read_recording

    write_annotations(output, read_recording(folder / name))


@corpus.command()
@folder
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of the map.")
def learn(folder: Path, seed: int) -> None:
    """Learn a map of the faces: main components, and 10 x 10 typical faces (a self-organising map).

    Typical faces get the name of their most frequent label, or else of the most similar template. Change the
    names in map.toml as you like. map.png shows where neighbours differ.
    """
    from realizer.corpus.learn import learn as learn_map
    from realizer.corpus.learn import save
    from realizer.corpus.recording import read_corpus

    learnt = learn_map([one for one in read_corpus(folder) if one.faps is not None or one.points], seed)
    save(folder, learnt)
    named = sum(bool(name) for name in learnt.names)
    options.note(f"{folder}: {len(learnt.components)} components, {named} of {len(learnt.names)} cells named")


@corpus.command()
@folder
def find(folder: Path) -> None:
    """Find expressions by the map, and write them as labels of the annotator `map`."""
    from realizer.corpus.find import FINDER, agreement
    from realizer.corpus.find import find as find_segments
    from realizer.corpus.learn import load
    from realizer.corpus.recording import read_corpus, write_recording

    learnt = load(folder)
    for one in read_corpus(folder):
        if one.faps is None and one.points is None:
            continue
        found = find_segments(one, learnt)
        kept = tuple(label for label in one.labels if label.by != FINDER)
        labels = (*kept, *(segment.annotation(one.fps) for segment in found))
        write_recording(folder / one.name, replace(one, labels=labels))
        said = f"{one.name}: {len(found)} segments"
        if kept:
            true = replace(one, labels=kept).segments()
            frames, met = agreement(true, found, one.frames)
            said += f"; {frames:.1%} of frames and {met:.1%} of segments as labelled"
        click.echo(said)


@corpus.command()
@folder
@click.option("--annotator", help="Whose labels to describe.  [default: the first of each recording]")
@click.option(
    "--language", default="en", show_default=True, metavar="TAG", help="Language of emotional words."
)
@click.option(
    "-o", "--output", metavar="DIR", type=options.OUTPUT, help="Folder to write.  [default: DIR/report]"
)
def describe(folder: Path, annotator: str | None, language: str, output: Path | None) -> None:
    """Write statistics as tables and report.html, and the rules, durations and profiles that follow.

    The tables are those of Wojdel 2005, 6.3 to 6.14, and table 4 of Raouzaiou et al. 2002. `realizer enrich
    --knowledge DIR/report` uses the rules, `realizer emotion --profiles DIR/report/profiles.txt` the
    profiles.
    """
    from realizer.corpus.recording import read_corpus
    from realizer.corpus.report import describe as write_report
    from realizer.corpus.statistics import Study
    from realizer.tables.emotional_words import word_list

    recordings = read_corpus(folder)
    tag = next((str(one.meta["language"]) for one in recordings if "language" in one.meta), language)
    study = Study(recordings, annotator, word_list(tag))
    if not study.every:
        raise click.UsageError(f"{folder}: wanted labels, got none; add some, or see `realizer corpus find`")
    target = output or folder / "report"
    names = write_report(target, study, folder)
    options.note(f"{target}: {', '.join(names)}")
