"""Conversion of texts and documents to timelines, and of timelines to documents."""

import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from bml_schema import (
    Block,
    BMLError,
    Expression,
    FaceInterpolator,
    FaceKeyframe,
    FaceLexeme,
    Speech,
    SyncRef,
    read,
    write,
)
from bml_schema.behaviours import SpeechText
from bml_schema.node_schema import local
from realizer.behaviours.keyframes import keys_of
from realizer.behaviours.registry import VOCABULARY
from realizer.core.array_types import Int16
from realizer.core.errors import RealizerError, TableError
from realizer.core.settings import Settings
from realizer.enrichment import Enrichment
from realizer.expressions.library import library_of
from realizer.expressions.timeline import Entry, Span, Timeline, Track, spans
from realizer.expressions.timeline_file import MIN_SECONDS, read_timeline, timeline_json, write_timeline
from realizer.knowledge.enrich import Enricher
from realizer.outputs.output import RenderSettings
from realizer.outputs.registry import OUTPUTS
from realizer.outputs.wav import RATE
from realizer.pipeline import plan, play
from realizer.playback.player import Player
from realizer.scheduling.timing import Schedule
from realizer.tables.knowledge import Mood
from realizer_studio.editors.design.fap_entries import fap_entries, is_fap
from realizer_studio.editors.design.frames import FILE, document

MAX_TEXT = 5_000  # characters of speech
PEAKS = 100  # peaks of the sound per second
NUMBERS = ("fap", "json", "csv")  # forms that `realizer timeline` writes as well
LOST = 0.002  # s; smaller differences of times are rounding errors


@dataclass
class Opened:
    """A timeline from a file or a text.

    Attributes:
        says: (start, text) of each speech, in seconds.
        words: (start, end, word) of the speeches, in seconds.
        syncs: (time, id) of the sync points in their texts, in seconds.
        peaks: largest amplitude of their sound, 0..1, in each hundredth of a second; [] without sound.
    """

    timeline: dict[str, object]
    left_out: list[str] = field(default_factory=list)  # a sentence for each part that a timeline cannot have
    says: list[tuple[float, str]] = field(default_factory=list)
    words: list[tuple[float, float, str]] = field(default_factory=list)
    syncs: list[tuple[float, str]] = field(default_factory=list)
    peaks: list[float] = field(default_factory=list)


def open_file(text: str, settings: Settings) -> Opened:
    """Read a timeline from a timeline file (TOML, JSON), BML or a FAP file.

    Raises:
        RealizerError: it is none of them; the message has a line for each fault.
    """
    if is_fap(text):
        expressions, keyframes, losses = fap_entries(text, list(library_of(settings.library_folder).values()))
        return Opened(timeline_json(Timeline((*_tracks(expressions), *_tracks(keyframes, "FAPs ")))), losses)
    if not text.lstrip("\ufeff \t\r\n").startswith("<"):
        timeline = read_timeline(text.encode())
        unknown = [
            f"{entry.expression}: unknown here"
            for track in timeline.tracks
            for entry in track.entries
            if entry.is_expression and entry.expression not in library_of(settings.library_folder)
        ]
        return Opened(timeline_json(timeline), unknown)
    return _from_bml([text], settings)


def enrich_text(text: str, settings: Settings, mood: Mood | None = None, *, listener: bool = False) -> Opened:
    """Return a timeline of the expressions that rules add to a text, for a speaker or listener.

    Raises:
        ValueError: no text, or a too long one.
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
    return found


def _from_bml(documents: Sequence[str], settings: Settings) -> Opened:
    player = Player(settings.play_options())
    blocks: list[Block] = []
    for item in (item for text in documents for item in read(text, VOCABULARY)):
        if isinstance(item, BMLError):
            raise TableError(str(item))
        blocks.append(item)
    schedules, refused = plan(documents, player, settings.voice)
    entries, losses = list[tuple[float, Entry]](), [warning.text for warning in refused]
    for block, schedule in zip(blocks, schedules, strict=False):
        entries += _expressions(block, schedule, losses)
    keyed = [one for one in entries if one[1].is_keyframes]
    named = [one for one in entries if one[1].is_expression]
    found = Opened(timeline_json(Timeline((*_tracks(named), *_tracks(keyed, "FAPs ")))), losses)
    for speech in player.speech():
        begin, utterance = speech.start, speech.utterance
        found.words += [(begin + word.start, begin + word.end, word.text) for word in utterance.words]
        found.syncs += [(begin + time, name) for name, time in utterance.marks.items()]
        if utterance.pcm is not None:
            found.peaks += [0.0] * (round(begin * PEAKS) - len(found.peaks))
            found.peaks += _peaks(utterance.pcm, utterance.sample_rate)
    for block, schedule in zip(blocks, schedules, strict=False):
        for node in block.behaviours:
            if isinstance(node, Speech) and node.text and node.id in schedule.times:
                start = schedule.start + float(schedule.times[node.id][0])
                found.says.append((round(start, 3), str(node.text)))
    return found


def _peaks(pcm: np.ndarray, rate: int) -> list[float]:
    size = max(1, rate // PEAKS)
    windows = np.abs(pcm[: len(pcm) // size * size].astype(np.int32)).reshape(-1, size)
    return [round(float(peak), 2) for peak in windows.max(axis=1) / 32768]


def _expressions(block: Block, schedule: Schedule, losses: list[str]) -> Iterable[tuple[float, Entry]]:
    """Yield start and entry of each expression, and add sentences about omitted behaviours to `losses`."""
    for node in block.behaviours:
        times = schedule.times.get(node.id)
        if times is None:
            losses.append(f"{node.id}: it is not played")
        elif isinstance(node, Expression | FaceLexeme):
            name, amount, because = _name_and_amount(node)
            point_times = dict(zip(schedule.points[node.id], (schedule.start + times).tolist(), strict=True))
            start, end = point_times["start"], point_times["end"]
            lengths = (end - start, point_times["attackPeak"] - start, end - point_times["relax"])
            duration, onset, offset = (round(max(seconds, MIN_SECONDS), 3) for seconds in lengths)
            yield start, Entry(name, amount, duration, onset, offset, because)
        elif isinstance(node, FaceKeyframe) and node.type == "FAPS":
            yield _keyframes(node, schedule.start + float(times[0]), float(times[-1] - times[0]))
        elif not isinstance(node, Speech):
            losses.append(f"{node.id}: a timeline holds expressions, got <{local(node.tag)}>")


def _name_and_amount(node: Expression | FaceLexeme) -> tuple[str, float, str | None]:
    if isinstance(node, Expression):
        return node.name, node.intensity, node.because
    return node.lexeme, node.amount, None


def _keyframes(node: FaceKeyframe, start: float, duration: float) -> tuple[float, Entry]:
    keys = keys_of(node)
    rows = np.column_stack([keys.times - keys.times[0], keys.values]).round(9).tolist()
    faps = tuple(part for part in keys.parts if isinstance(part, int))
    return start, Entry("keyframes", duration=round(duration, 3), faps=faps, keys=tuple(map(tuple, rows)))


def _tracks(placed_entries: list[tuple[float, Entry]], name: str = "") -> tuple[Track, ...]:
    """Return tracks of entries with their starts, each on the first track that is free."""
    lanes: list[tuple[float, list[Entry], float]] = []  # start, entries, end
    for start, entry in sorted(placed_entries, key=lambda one: one[0]):
        start, length = round(start, 3), entry.duration or 0.0
        for k, (begin, entries, end) in enumerate(lanes):
            if start - end >= MIN_SECONDS or abs(start - end) < LOST:
                gap = [Entry("neutral", duration=round(start - end, 3))] if start - end >= MIN_SECONDS else []
                lanes[k] = (begin, [*entries, *gap, entry], start + length)
                break
        else:
            lanes.append((start, [entry], start + length))
    return tuple(Track(f"{name}{k}", tuple(row[1]), start=row[0]) for k, row in enumerate(lanes, 1))


def sound(says: Sequence[tuple[float, str]], settings: Settings) -> Int16:
    """Return speeches of (start, text) as (n,) int16 of `RATE`; (0,) if the voice is silent.

    Raises:
        ValueError: the text is too long.
    """
    if sum(len(text) for _, text in says) > MAX_TEXT:
        raise ValueError(f"wanted at most {MAX_TEXT} characters")
    block = Block(id="speech", children=_speeches(says))
    samples = play([write(block)], settings.play_options(), settings.voice).sound(RATE)
    return samples if samples.any() else samples[:0]


def _speeches(says: Sequence[tuple[float, str]]) -> tuple[Speech, ...]:
    return tuple(
        Speech(
            id=f"speech{number}",
            text=SpeechText(parts=(text,)),
            syncs={"start": SyncRef(offset=float(start))},
        )
        for number, (start, text) in enumerate(says, 1)
        if text.strip()
    )


def export(timeline: Timeline, form: str, settings: Settings, says: Sequence[tuple[float, str]] = ()) -> str:
    """Return a timeline as toml, json, bml, fap or csv.

    Args:
        says: (start, text) of the speeches in BML.

    Raises:
        ValueError: an unknown form.
    """
    if form == "toml":
        return write_timeline(timeline)
    if form == "bml":
        return write(_block(timeline, settings, says))
    if form not in NUMBERS:
        raise ValueError(f"form: wanted one of toml, bml, {', '.join(NUMBERS)}, got {form[:80]!r}")
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, FILE).write_text(write_timeline(timeline), "utf-8")
        options = replace(settings.play_options(), media=Path(folder))
        played = play([document()], options, "silent")
        if not played.has_content:
            raise RealizerError("; ".join([*played.refusals, "the timeline is not played"]))
        return OUTPUTS[f".{form}"].encode(played, RenderSettings()).decode()


def _block(timeline: Timeline, settings: Settings, says: Sequence[tuple[float, str]]) -> Block:
    """Return a block with a behaviour for each entry, without curves, joins and mixer."""
    library = library_of(settings.library_folder)
    children: list[Speech | Expression | FaceKeyframe] = [*_speeches(says)]
    for number, track in enumerate(timeline.tracks, 1):
        for k, span in enumerate(spans(track, library), 1):
            id = f"channel{number}-{k}"
            if span.entry.is_keyframes:
                children.append(_keyframe(id, span))
            elif span.entry.is_expression:
                children.append(_expression(id, span))
    return Block(id="timeline", children=tuple(children))


def _expression(id: str, span: Span) -> Expression:
    times = {"start": span.start, "attackPeak": span.reached, "relax": span.left, "end": span.end}
    syncs = {name: SyncRef(offset=round(time, 3)) for name, time in times.items()}
    name, intensity, because = span.entry.expression, span.entry.intensity, span.entry.because
    return Expression(id=id, name=name, intensity=intensity, because=because, syncs=syncs)


def _keyframe(id: str, span: Span) -> FaceKeyframe:
    rows = [(time, *(span.entry.intensity * value for value in row)) for time, *row in span.entry.keys]
    keys = "\n".join(" ".join(f"{number:.12g}" for number in row) for row in rows)
    syncs = {"start": SyncRef(offset=round(span.start, 3)), "end": SyncRef(offset=round(span.end, 3))}
    parts = " ".join(map(str, span.entry.faps))
    return FaceKeyframe(
        id=id, type="FAPS", interpolator=FaceInterpolator(parts=parts, keys=f"\n{keys}\n"), syncs=syncs
    )
