"""Advice on valid blocks that look like mistakes."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bml_schema import (
    BMLA,
    BMLT,
    CORE,
    EXTENSIONS,
    OWN,
    Block,
    Gaze,
    GazeShift,
    HeadDirectionShift,
    Speech,
    SyncRef,
)
from bml_schema.node_schema import local, schema_of
from bml_schema.reading.tolerant_scanner import Element
from bml_schema.source import Source
from realizer.behaviours.gaze_targets import is_known
from realizer.checking.document import CheckedBlock
from realizer.checking.explain import near
from realizer.checking.finding import Finding, Label
from realizer.knowledge.advice import VisibleExpression, advise
from realizer.knowledge.enrich import template_of
from realizer.knowledge.word_languages import Words
from realizer.playback.player import Player
from realizer.scheduling.timing import Schedule
from realizer.speech.words import words_in
from realizer.tables.knowledge import Mood, Role

ADVICE = "ADVICE"
MAX_SECONDS = 250.0  # longer times are probably milliseconds
MIN_SECONDS = 0.04  # shorter motion may be between two frames at 25 fps
MAX_DEVIATION = 2.0  # standard deviations below the mean; a shorter gap is unnatural
KNOWN_SPACES = frozenset({CORE, EXTENSIONS, BMLA, BMLT, OWN})


def advice(file: str, source: Source, block: Block, schedule: Schedule, player: Player) -> Iterator[Finding]:
    """Yield advice on misspelt attributes and elements, times in milliseconds, and unnatural motion.

    Args:
        schedule: schedule of the block by `player`.
    """
    yield from _Advisor(file, source, block, block).attributes()
    is_long = False  # whether there was advice on a long time: one document has all its times in one unit
    for node in block.behaviours:
        place = block.places.get(node.id)
        if place is not None:
            advisor = _Advisor(file, source, block, node, place.path, place.line)
            yield from advisor.attributes()
            yield from advisor.children()
            for finding in () if is_long else advisor.units():
                yield finding
                is_long = True
            yield from advisor.target(player)
            if node.id in schedule.times:
                yield from advisor.muscles(schedule, player)


@dataclass(frozen=True)
class _Advisor:
    """Makes the findings about `node`, which is a behaviour or the block itself."""

    file: str
    source: Source
    block: Block
    node: Any
    path: str = "/bml"
    line: int | None = None

    def attributes(self) -> Iterator[Finding]:
        """Yield advice on unknown attributes of BMLA and BMLT that are similar to a known one.

        Many attributes of these languages are not in the schema; unknown attributes of BML are faults.
        """
        known = schema_of(type(self.node)).attributes
        for name in self.node.unknown_attributes:
            space = name.rpartition("}")[0]
            if space[1:] not in (BMLA, BMLT):
                continue
            choices = [local(other) for other in known if other.rpartition("}")[0] == space]
            meant = near(local(name), choices, 0.75)
            element = self.element() if meant else None
            if element is None or meant is None or self.source.value_span(element, meant):
                continue
            text = f"{local(name)}: no attribute of <{local(self.node.tag)}>, so it does nothing"
            label = Label(self.source.attribute_spot(element, name), "does nothing")
            yield self.finding(text, label, f'help: did you mean "{meant}"?')

    def children(self) -> Iterator[Finding]:
        """Yield advice on unknown child elements of a behaviour that are similar to a known one."""
        element = self.element()
        known = {local(tag): tag for tag in schema_of(type(self.node)).by_tag}
        if element is None or not known:
            return
        for inner in self.source.below(element):
            prefix, _, name = inner.name.rpartition(":")
            if not prefix or self.source.elements[inner.parent] is not element or name in known:
                continue
            meant = near(name, known, 0.75)
            if meant is not None and self.namespace(inner.name) in KNOWN_SPACES:
                text = f"<{inner.name}>: no element of <{local(self.node.tag)}>, so it does nothing"
                label = Label(self.source.name_spot(inner), "does nothing")
                yield self.finding(text, label, f'help: did you mean "{prefix}:{meant}"?')

    def namespace(self, name: str) -> str:
        """Return the namespace of an element name by the first declaration of its prefix."""
        declaration = f"xmlns:{name.rpartition(':')[0]}"
        found = (
            self.source.value(e, declaration) for e in self.source.elements if declaration in e.attributes
        )
        return next(found, "")

    def units(self) -> Iterator[Finding]:
        """Yield advice on times that are probably milliseconds."""
        times = [(name, ref.offset) for name, ref in self.node.syncs.items() if isinstance(ref, SyncRef)]
        times += [("duration", self.node.duration)] if hasattr(self.node, "duration") else []
        for name, seconds in times:
            if abs(seconds) >= MAX_SECONDS:
                text = f"{name}: {seconds:g} s are {_minutes(abs(seconds))}; BML counts in seconds"
                hint = f"help: if these are milliseconds, write {seconds / 1000:g}"
                yield self.finding(text, self.label(_minutes(abs(seconds)), name), hint)

    def target(self, player: Player) -> Iterator[Finding]:
        """Yield advice on a target that only a scene can declare, if there is no scene."""
        if player.context.scene is not None or not isinstance(
            self.node, Gaze | GazeShift | HeadDirectionShift
        ):
            return
        if not is_known(self.node.target, player.context):
            text = f"target: there is no scene, so {self.node.target!r} is taken as straight ahead"
            hint = "help: declare it with --scene, or use LEFT, RIGHT, UP, DOWN, CAMERA, USER or a point"
            yield self.finding(text, self.label("not declared", "target"), hint)

    def muscles(self, schedule: Schedule, player: Player) -> Iterator[Finding]:
        """Yield advice on motion that takes less than a frame, or is faster than muscles can be."""
        node, times = self.node, schedule.times[self.node.id]
        kind, seconds = player.kinds[node.tag], float(times[-1] - times[0])
        if not node.syncs or kind.command is not None or kind.speech_request is not None:
            return
        if 0 < seconds < MIN_SECONDS:
            text = f"lasts {seconds:.3g} s from start to end, less than a frame"
            hint = "help: it may not be seen at all; BML counts in seconds"
            yield self.finding(text, self.label("less than a frame"), hint)
            return
        if kind.region is None and not node.sync_points[1:-1]:
            return  # no motion: a wait, a sound
        timing = kind.timing(node, replace(player.context, utterances={}))
        deviation = 1 / np.sqrt(timing.stiffness)
        for n, gap in enumerate(np.diff(times).tolist()):
            usual = float(timing.preferred[n])
            if timing.rigid or not gap < usual - MAX_DEVIATION * float(deviation[n]):
                continue
            begin, end = timing.points[n : n + 2]
            text = f"{begin} to {end} in {gap:.2g} s; this usually takes {usual:.2g} s"
            name = next((p for p in (end, begin, *node.syncs) if p in node.syncs), "")
            hint = f"help: leave {end} or {begin} out, and they are placed where they look natural"
            yield self.finding(text, self.label("faster than muscles are", name), hint)
            return

    def element(self) -> Element | None:
        return self.source.find(self.path, line=self.line, block=self.block.id)

    def label(self, text: str, attribute: str = "") -> Label:
        return Label(self.source.locate(self.path, attribute, line=self.line, block=self.block.id), text)

    def finding(self, text: str, label: Label, note: str) -> Finding:
        id = self.block.id if isinstance(self.node, Block) else f"{self.block.id}:{self.node.id}"
        return Finding(self.file, ADVICE, id, self.path, text, text, (label,), (note,))


def _minutes(seconds: float) -> str:
    minutes = seconds / 60
    return f"{minutes / 60:.1f} hours" if minutes >= 90 else f"{math.floor(minutes * 10) / 10:g} minutes"


def advise_on_behaviours(
    file: str, source: Source, part: CheckedBlock, role: Role, mood: Mood | None, lists: Words
) -> Iterator[Finding]:
    """Yield advice on expressions whose duration, order or words are unusual for people.

    Args:
        part: a block with its schedule.
        lists: lists of emotional words.
    """
    block, schedule, utterances = part.block, part.schedule, part.utterances
    assert block is not None
    assert schedule is not None
    seen = [
        VisibleExpression(node.id, template, (start + peak) / 2, (relax + end) / 2)
        for node in block.behaviours
        if (template := template_of(node)) and node.id in schedule.times
        for start, peak, relax, end in [schedule.times[node.id].tolist()]
    ]
    words = {}  # speech id -> (place in the text, seconds) of each word
    for node in block.behaviours:
        if isinstance(node, Speech) and node.id in schedule.times and node.id in utterances:
            places = [place for _, place in words_in(str(node.text or ""))]
            spoken = utterances[node.id].words
            # A description may be spoken instead of the text; then the words have no known times.
            if len(places) == len(spoken):
                begin = float(schedule.times[node.id][0])
                words[node.id] = [(p, begin + w.start) for p, w in zip(places, spoken, strict=True)]
    for advice in advise(block, seen, words, role, mood, lists):
        place = block.places.get(advice.id)
        path, line = (place.path, place.line) if place is not None else ("/bml", None)
        label = Label(source.locate(path, line=line, block=block.id))
        id = f"{block.id}:{advice.id}" if advice.id else block.id
        text, notes = f"{advice.text}; {advice.hint}", (f"help: {advice.hint}",)
        yield Finding(file, ADVICE, id, path, text, advice.text, (label,), notes, advice.is_impossible)
