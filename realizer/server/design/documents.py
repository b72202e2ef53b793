"""Timelines from texts and documents, and documents from timelines."""

import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from bml_schema import Block, BMLError, Expression, FaceLexeme, Speech, SyncRef, read, write
from bml_schema.behaviours import SpeechText
from bml_schema.node_schema import local
from realizer.behaviours.registry import VOCABULARY
from realizer.core.errors import RealizerError, TableError
from realizer.core.settings import Settings
from realizer.enrichment import Enrichment
from realizer.expressions.library import library_of
from realizer.expressions.timeline import Entry, Timeline, Track, spans
from realizer.expressions.timeline_file import MIN_SECONDS, read_timeline, timeline_json, write_timeline
from realizer.knowledge.enrich import Enricher
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS
from realizer.pipeline import plan, play
from realizer.playback.player import Player
from realizer.scheduling.timing import Schedule
from realizer.server.design.fap_entries import fap_entries, is_fap
from realizer.server.design.frames import FILE, document
from realizer.tables.knowledge import Mood

MAX_TEXT = 5_000  # characters that are spoken
PEAKS = 100  # of the sound, a second
NUMBERS = ("fap", "json", "csv")  # forms that `realizer timeline` writes, too
LOST = 0.002  # s; smaller differences of times come from rounding


@dataclass
class Opened:
    """A timeline from a file or a text.

    Attributes:
        words: (start, end, word) of the speech, in seconds.
        peaks: largest amplitude of its sound, 0..1, in each hundredth of a second; [] without sound.
    """

    timeline: dict[str, object]
    left_out: list[str] = field(default_factory=list)  # what a timeline cannot hold, a sentence each
    text: str = ""
    words: list[tuple[float, float, str]] = field(default_factory=list)
    peaks: list[float] = field(default_factory=list)


def open_file(text: str, settings: Settings) -> Opened:
    """Read a timeline file (TOML, JSON), or the expressions of BML or of a FAP file.

    Raises:
        RealizerError: it is none of them; the text has a line for each fault.
    """
    if is_fap(text):
        shown, left = fap_entries(text, list(library_of(settings.library_folder).values()))
        return Opened(timeline_json(_lanes(shown)), left)
    if not text.lstrip("\ufeff \t\r\n").startswith("<"):
        timeline = read_timeline(text.encode())
        unknown = [
            f"{entry.expression}: unknown here"
            for track in timeline.tracks
            for entry in track.entries
            if not entry.neutral and entry.expression not in library_of(settings.library_folder)
        ]
        return Opened(timeline_json(timeline), unknown)
    return _from_bml([text], settings)


def enrich_text(text: str, settings: Settings, mood: Mood | None = None, *, listener: bool = False) -> Opened:
    """Return the expressions that people show while they say a text, or listen to it, with their reasons.

    Raises:
        ValueError: there is no text, or too much.
    """
    if len(text) > MAX_TEXT:
        raise ValueError(f"wanted at most {MAX_TEXT} characters, got {len(text)}")
    notes: list[str] = []
    enricher = Enricher("listener" if listener else "speaker", mood)
    enriched = Enrichment.of(text.replace("<", " "), enricher, notes.append)
    found = _from_bml([write(block) for block in enriched.blocks], settings)
    if listener:
        found.left_out += notes
    else:
        found.left_out = notes
    found.text = text
    return found


def _from_bml(documents: Sequence[str], settings: Settings) -> Opened:
    player = Player(settings.play_options())
    blocks: list[Block] = []
    for item in (item for text in documents for item in read(text, VOCABULARY)):
        if isinstance(item, BMLError):
            raise TableError(str(item))
        blocks.append(item)
    schedules, refused = plan(documents, player, settings.voice)
    shown, left = list[tuple[float, Entry]](), [warning.text for warning in refused]
    for block, schedule in zip(blocks, schedules, strict=False):
        shown += _expressions(block, schedule, left)
    found = Opened(timeline_json(_lanes(shown)), left)
    for speech in player.speech():
        begin, said = speech.start, speech.utterance
        found.words += [(begin + word.start, begin + word.end, word.text) for word in said.words]
        if said.pcm is not None and not found.peaks:
            found.peaks = [0.0] * round(begin * PEAKS) + _peaks(said.pcm, said.sample_rate)
    found.text = " ".join(
        str(node.text)
        for block in blocks
        for node in block.behaviours
        if isinstance(node, Speech) and node.text
    )
    return found


def _peaks(pcm: np.ndarray, rate: int) -> list[float]:
    size = max(1, rate // PEAKS)
    whole = np.abs(pcm[: len(pcm) // size * size].astype(np.int32)).reshape(-1, size)
    return [round(float(peak), 2) for peak in whole.max(axis=1) / 32768]


def _expressions(block: Block, schedule: Schedule, left: list[str]) -> Iterable[tuple[float, Entry]]:
    """Yield start and entry of each expression, and add to `left` what a timeline cannot hold."""
    for node in block.behaviours:
        times = schedule.times.get(node.id)
        if times is None:
            left.append(f"{node.id}: it is not played")
        elif isinstance(node, Expression | FaceLexeme):
            name, amount, because = _shown(node)
            at = dict(zip(schedule.points[node.id], (schedule.start + times).tolist(), strict=True))
            start, end = at["start"], at["end"]
            yield (
                start,
                Entry(
                    name,
                    amount,
                    round(max(end - start, MIN_SECONDS), 3),
                    round(max(at["attackPeak"] - start, MIN_SECONDS), 3),
                    round(max(end - at["relax"], MIN_SECONDS), 3),
                    because,
                ),
            )
        elif not isinstance(node, Speech):
            left.append(f"{node.id}: a timeline holds expressions, got <{local(node.tag)}>")


def _shown(node: Expression | FaceLexeme) -> tuple[str, float, str | None]:
    if isinstance(node, Expression):
        return node.name, node.intensity, node.because
    return node.lexeme, node.amount, None


def _lanes(shown: list[tuple[float, Entry]]) -> Timeline:
    """Return a timeline of entries at these starts: each in the first channel that has room for it."""
    lanes: list[tuple[float, list[Entry], float]] = []  # start, entries, end
    for start, entry in sorted(shown, key=lambda one: one[0]):
        start, length = round(start, 3), entry.duration or 0.0
        for k, (begin, entries, end) in enumerate(lanes):
            if start - end >= MIN_SECONDS or abs(start - end) < LOST:
                gap = [Entry("neutral", duration=round(start - end, 3))] if start - end >= MIN_SECONDS else []
                lanes[k] = (begin, [*entries, *gap, entry], start + length)
                break
        else:
            lanes.append((start, [entry], start + length))
    tracks = (Track(str(k), tuple(row[1]), start=row[0]) for k, row in enumerate(lanes, 1))
    return Timeline(tuple(tracks))


def export(timeline: Timeline, form: str, settings: Settings, speech: str | None = None) -> str:
    """Return a timeline in another form: toml, json (the timeline), bml, or numbers: fap, csv.

    Args:
        speech: a text that BML speaks from its start.

    Raises:
        ValueError: no such form.
    """
    if form == "toml":
        return write_timeline(timeline)
    if form == "bml":
        return write(_block(timeline, settings, speech))
    if form not in NUMBERS:
        raise ValueError(f"form: wanted one of toml, bml, {', '.join(NUMBERS)}, got {form[:80]!r}")
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, FILE).write_text(write_timeline(timeline), "utf-8")
        options = replace(settings.play_options(), media=Path(folder))
        played = play([document()], options, "silent")
        if not played.has_content:
            raise RealizerError("; ".join([*played.refusals, "the timeline is not played"]))
        return OUTPUTS[f".{form}"].encode(played, RenderSettings()).decode()


def _block(timeline: Timeline, settings: Settings, speech: str | None) -> Block:
    """Return a block with an expression for each entry; it loses curves, joins and the mixer."""
    library = library_of(settings.library_folder)
    children: list[Speech | Expression] = []
    if speech and speech.strip():
        start = {"start": SyncRef(offset=0.0)}
        children.append(Speech(id="speech1", text=SpeechText(parts=(speech,)), syncs=start))
    for number, track in enumerate(timeline.tracks, 1):
        for k, span in enumerate(spans(track, library), 1):
            if not span.entry.neutral:
                times = (span.start, span.reached, span.left, span.end)
                points = zip(("start", "attackPeak", "relax", "end"), times, strict=True)
                syncs = {name: SyncRef(offset=round(time, 3)) for name, time in points}
                entry = span.entry
                children.append(
                    Expression(
                        id=f"channel{number}-{k}",
                        name=entry.expression,
                        intensity=entry.intensity,
                        because=entry.because,
                        syncs=syncs,
                    )
                )
    return Block(id="timeline", children=tuple(children))
