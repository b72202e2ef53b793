"""`corpus`: makes labelled segments, statistics, rules and profiles from recordings of people."""

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any, TypeAlias

import click

from realizer.cli import inputs, options
from realizer.cli.options import option
from realizer.cli.progress import note
from realizer.core.settings import Settings
from realizer_studio.cli.faces import serve_tab
from realizer_studio.cli.track import follow as follow_faces
from realizer_studio.cli.track import follow_markers, marker_options, marker_settings

folder = click.argument("folder", metavar="DIR", type=options.FOLDER)
SEGMENT = (click.FLOAT, click.FLOAT, click.STRING)
Spans: TypeAlias = tuple[tuple[float, float, str], ...]


@click.group()
def corpus() -> None:
    """Learn from recordings of people (Wojdel 2005, chapters 6 and 7).

    \b
    realizer corpus init films
    realizer corpus add films anna --person anna --mood anxiety anna.csv anna.eaf
    realizer corpus track films
    realizer corpus label films anna --annotator eva --add 1.2 1.9 surprise
    realizer corpus learn films
    realizer corpus find films
    realizer corpus describe films
    realizer enrich "Are you sure?" --knowledge films/report
    """


@corpus.command()
@click.argument("folder", metavar="DIR", type=options.OUTPUT)
def init(folder: Path) -> None:
    """Make an empty corpus."""
    from realizer_studio.corpus.recording import CORPUS

    if (folder / CORPUS).exists():
        raise click.UsageError(f"{folder}: wanted a new folder, got a corpus")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / CORPUS).write_text("version = 1\n", "utf-8")
    note(f"{folder}: a corpus without recordings; add some by `realizer corpus add {folder} NAME FILE`")


@corpus.command()
@folder
@click.argument("name")
@click.argument("files", nargs=-1, type=options.FILE)
@option("--person", "Who is recorded; the speaker of that name, or `subject`, is this person.")
@option("--mood", "Mood of the person; several by commas.")
@option("--fragment", "Name of the fragment or scene in tables.  [default: NAME]")
@option("--language TAG", "Language of the words, as a BCP-47 tag.  [default: en]")
@option("--licence", "Licence of the recording.")
@option("--fps", "Frames per second.  [default: of the files, or 25]", options.Number(1, 1000))
@option("--frames", "Frames, if more than files tell.", click.IntRange(1, 1_000_000))
def add(folder: Path, name: str, files: tuple[Path, ...], **facts: Any) -> None:
    """Add a recording NAME, or more FILES of it: a film, FAPs, points, labels and words.

    A FILE is a film, which is copied for `realizer corpus track`, .fap or .csv (of `realizer track`, our
    labels, words or points, OpenFace, Live Link), .eaf of ELAN, .TextGrid of Praat, or .json (MediaPipe, or
    words of `realizer align`). A tier `words` or `words SPEAKER` has words; any other has the labels of the
    annotator of its name.
    """
    from realizer.core.atomic_files import replacing
    from realizer_studio.corpus import recording as recordings
    from realizer_studio.corpus.films import is_film
    from realizer_studio.corpus.formats import merged, read_part

    path = folder / name
    _check_corpus(folder)
    if Path(name).name != name or name.startswith("."):
        raise click.UsageError(f"wanted a name without / for the recording, got {name!r}")
    exists = (path / recordings.META).is_file()
    found = recordings.read_recording(path) if exists else recordings.Recording(name)
    for file in files:
        if is_film(file):
            path.mkdir(exist_ok=True)
            with replacing(path / f"film{file.suffix.lower()}") as draft:
                shutil.copyfile(file, draft)
        else:
            found = merged(found, read_part(file))
    given = {key: fact for key, fact in facts.items() if fact is not None}
    found = replace(found, meta={**found.meta, **given})
    recordings.write_recording(path, found)
    note(f"{path}: {found.frames} frames, {len(found.labels)} labels, {len(found.words)} words")


@corpus.command()
@folder
@click.argument("names", nargs=-1)
@marker_options
@option("--neutral", "Number of the picture that shows markers at rest.", click.IntRange(0))
@options.face("Face whose feature points markers are laid on", default="default", show_default=True)
def track(folder: Path, names: tuple[str, ...], neutral: int | None, face: str, **chosen: Any) -> int:
    """Track the films of a corpus, or of recordings NAMES, that have no points or FAPs yet.

    A film is in the folder of its recording, or beside these folders, with the name of its recording. With
    --markers, --marker-colour or --marker-at, painted markers are followed instead of the face. What was
    interrupted is done again, what is done is left alone. Exits with 1 if a film cannot be tracked.
    """
    from realizer_studio.corpus import films
    from realizer_studio.corpus.recording import CorpusError, write_recording
    from realizer_studio.tracking.network import TrackingError

    _check_corpus(folder)
    found = films.films(folder)
    if unknown := sorted({*names} - {target.name for target in found.values()}):
        raise click.UsageError(f"{folder}: wanted recordings with a film, got {unknown[0]!r}")
    failed = done = 0
    for film, target in found.items():
        try:
            if (names and target.name not in names) or (recording := films.to_track(target)) is None:
                continue
            settings = marker_settings(film, chosen, neutral)
            if settings is not None:
                recording = films.with_markers(recording, follow_markers(film, settings, None), face)
            else:
                times, people = follow_faces(film, None)
                recording = films.with_face(recording, people[0], times)
                if len(people) > 1:
                    note(f"{film}: {len(people)} people; took the one who is seen most")
            write_recording(target, recording)
        except (TrackingError, CorpusError) as error:
            click.echo(f"realizer: {error}", err=True)
            failed += 1
            continue
        done += 1
        note(f"{target}: {recording.frames} frames")
    note(f"{folder}: {done} of {len(found)} films tracked, {failed} failed")
    return 1 if failed else 0


@corpus.command()
@folder
@click.argument("name", required=False)
@option("--annotator", "Whose labels to add or remove.", default="me")
@option("--add START END EXPRESSION", "Seconds.", SEGMENT, name="added", multiple=True)
@option("--remove START END EXPRESSION", type=SEGMENT, name="removed", multiple=True)
@click.option("--page", is_flag=True, help="Label in the browser; prints the page's address.")
@click.option("--port", default=0, help="Port of the page.  [default: a free one]")
@click.option("--browser/--no-browser", default=True, help="Open the page in the browser.")
def label(folder: Path, name: str | None, annotator: str, **chosen: Any) -> None:
    """Add or remove segments of a recording NAME, and print them with the agreement of annotators.

    With --page, serve the page's tab Label on this machine until Ctrl-C: film, sound and words, and a lane of
    labels for each annotator. It needs no NAME. Segments of other programs come in by `realizer corpus add`,
    and go out by `realizer corpus export`.
    """
    import asyncio

    _check_corpus(folder)
    if chosen["page"]:
        settings = Settings.read({"host": "127.0.0.1", "port": chosen["port"], "corpus": folder})
        asyncio.run(serve_tab(settings, "label", chosen["browser"]))
    elif name is None:
        raise click.UsageError(f"{folder}: wanted the NAME of a recording, or --page")
    else:
        _label(folder, name, annotator, chosen["added"], chosen["removed"])


def _label(folder: Path, name: str, annotator: str, added: Spans, removed: Spans) -> None:
    """Change and print the labels of a recording."""
    from realizer_studio.corpus.agreement import agreement
    from realizer_studio.corpus.recording import CorpusError, change, read_recording, write_recording

    with inputs.reporting(CorpusError):
        found = read_recording(folder / name)
        if added or removed:
            found = change(found, annotator, added, removed)
            write_recording(folder / name, found)
    for one in found.labels:
        click.echo(f"{one.start:9.3f} {one.end:9.3f}  {one.text}  [{one.by}]")
    if len(found.annotators) > 1:
        table = agreement([found])
        for expression, alpha in table.rows:
            click.echo(f"{table.title}, {expression}: {'-' if alpha is None else f'{alpha:.2f}'}")


def _check_corpus(folder: Path) -> None:
    from realizer_studio.corpus.recording import CORPUS

    if not (folder / CORPUS).is_file():
        raise click.UsageError(f"{folder}: wanted a corpus; make one by `realizer corpus init {folder}`")


@corpus.command()
@folder
@click.argument("name")
@option("-o --output FILE", ".eaf or .TextGrid", options.OUTPUT, required=True)
def export(folder: Path, name: str, output: Path) -> None:
    """Write the labels and words of a recording for ELAN or Praat."""
    from realizer_studio.corpus.formats import write_annotations
    from realizer_studio.corpus.recording import read_recording

    write_annotations(output, read_recording(folder / name))


@corpus.command()
@folder
@option("--seed", "Seed of the map.", click.IntRange(0), default=0)
def learn(folder: Path, seed: int) -> None:
    """Learn a map of the faces: main components, and 10 x 10 typical faces (a self-organising map).

    Typical faces get the name of their most frequent label, or else of the most similar template. Change the
    names in map.toml as you like. map.png shows where neighbours differ.
    """
    from realizer_studio.corpus import face_map
    from realizer_studio.corpus.recording import read_corpus

    learnt = face_map.learn([one for one in read_corpus(folder) if one.has_frames], seed)
    face_map.save(folder, learnt)
    named = sum(map(bool, learnt.names))
    note(f"{folder}: {len(learnt.components)} components, {named} of {len(learnt.names)} cells named")


@corpus.command()
@folder
def find(folder: Path) -> None:
    """Find expressions by the map, and write them as labels of the annotator `map`."""
    from realizer_studio.corpus import finder
    from realizer_studio.corpus.face_map import load
    from realizer_studio.corpus.recording import read_corpus, write_recording

    learnt = load(folder)
    for one in (recording for recording in read_corpus(folder) if recording.has_frames):
        found = finder.find(one, learnt)
        others_labels = replace(one, labels=tuple(label for label in one.labels if label.by != finder.FINDER))
        labels = (*others_labels.labels, *(segment.annotation(one.fps) for segment in found))
        write_recording(folder / one.name, replace(one, labels=labels))
        frames, met = finder.agreement(others_labels.segments(), found, one.frames)
        agrees = (
            f"; {frames:.1%} of frames and {met:.1%} of segments as labelled" if others_labels.labels else ""
        )
        click.echo(f"{one.name}: {len(found)} segments{agrees}")


@corpus.command()
@folder
@option("--annotator", "Whose labels to describe.  [default: the first of each recording]")
@option("-o --output DIR", "Folder to write.  [default: DIR/report]", options.OUTPUT)
@option("--word", "A word with a row in table 6.11 even if it is rare.", name="watched", multiple=True)
def describe(folder: Path, annotator: str | None, output: Path | None, watched: tuple[str, ...]) -> None:
    """Write statistics as tables and report.html, and the rules, durations, profiles and expressions.

    The tables are those of Wojdel 2005, 6.3 to 6.14, and table 4 of Raouzaiou et al. 2002. `realizer enrich
    --knowledge DIR/report` uses the rules, `realizer emotion --profiles DIR/report/profiles.txt` the
    profiles, and `realizer realize --expressions DIR/report/expressions` the expressions.
    """
    from realizer.tables.emotional_words import word_list
    from realizer_studio.corpus.recording import read_corpus
    from realizer_studio.corpus.report import describe as write_report
    from realizer_studio.corpus.statistics import Study

    recordings, target = read_corpus(folder), output or folder / "report"
    language = next((str(one.meta["language"]) for one in recordings if "language" in one.meta), "en")
    study = Study(recordings, annotator, word_list(language), frozenset(map(str.lower, watched)))
    if not study.every:
        raise click.UsageError(f"{folder}: wanted labels, got none; add some, or see `realizer corpus find`")
    note(f"{target}: {', '.join(write_report(target, study, folder))}")
