"""Checks of documents that find every fault of every block."""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from bml_schema import (
    Behaviour,
    Block,
    BMLError,
    ParameterValueChange,
    Problem,
    Required,
    WarningFeedback,
    read,
)
from bml_schema.source import Source
from realizer.behaviours.kind import PlanningContext
from realizer.behaviours.registry import VOCABULARY
from realizer.checking.explain import attributes_of, finding_of
from realizer.checking.finding import Finding
from realizer.playback.block_commands import CommandError, initial_value
from realizer.playback.feedback_events import parse_warning
from realizer.playback.player import Player
from realizer.playback.speaking import submit_with_speech, synthesize
from realizer.scheduling.timing import Schedule, Warning
from realizer.sources import NOTHING
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Utterance


@dataclass(frozen=True)
class CheckedBlock:
    """The faults of a block, or of a part of a document that is not a block.

    Attributes:
        findings: faults by their place.
        block, schedule: None if it is not a block.
        utterances: speech id -> utterance of the silent voice.
    """

    findings: tuple[Finding, ...]
    block: Block | None = None
    schedule: Schedule | None = None
    utterances: Mapping[str, Utterance] = field(default_factory=dict)


def check_document(file: str, source: Source, text: bytes | str, player: Player) -> Iterator[CheckedBlock]:
    """Check the blocks of a document in order.

    Args:
        file: name of the file, for the findings.
        source: the text with its positions.
        player: plays all blocks, so that blocks may refer to earlier ones.
    """
    voice = SilentVoice()
    planned = set[str]()  # "block:behaviour"
    items = list(read(text, VOCABULARY, strict_bml=player.strict_bml)) or [NOTHING]
    for item, whole in zip(items, without_faults(source, items, player.strict_bml), strict=True):
        if isinstance(item, Block):
            utterances = synthesize(player.speech_requests(item), voice)
            schedule, warnings = check_block(item, player, utterances)
            if whole is not None:
                context = replace(player.context, utterances=dict(utterances))
                warnings += masked_faults(item, whole, player, context)
            planned.update(f"{item.id}:{behaviour}" for behaviour in schedule.times)
            yield CheckedBlock(_explained(file, source, warnings), item, schedule, utterances)
        else:
            yield CheckedBlock(_explained(file, source, [parse_warning(item)]))
    # Conflicts of blocks are settled when they start.
    feedback = player.due(math.inf) if len(items) > 1 else []
    warnings = [Warning(f.id, f.type, f.text) for f in feedback if isinstance(f, WarningFeedback)]
    if later := [w for w in warnings if w.id in planned and w.type == "CANNOT_CREATE_BEHAVIOR"]:
        yield CheckedBlock(_explained(file, source, later))


def _explained(file: str, source: Source, warnings: list[Warning]) -> tuple[Finding, ...]:
    findings = [finding_of(file, source, warning, VOCABULARY) for warning in warnings]
    return tuple(sorted(findings, key=lambda finding: finding.spot or (0,)))


def check_block(
    block: Block, player: Player, utterances: Mapping[str, Utterance]
) -> tuple[Schedule, list[Warning]]:
    """Schedule a block and return all warnings, even if a single fault would make the block fail.

    Args:
        utterances: speech id -> utterance of the silent voice.
    """
    warnings = [Warning(p.id, p.type, str(p)) for p in block.problems]
    context = replace(player.context, utterances=dict(utterances))
    bad: set[str] = set()
    for node in block.behaviours:
        kind = player.kinds.get(node.tag)
        faults = kind.check(node, context) if kind is not None else ()
        warnings += [located_warning(block, node.id, fault.type, fault.text) for fault in faults]
        if any(fault.fatal for fault in faults):
            bad.add(node.id)
    # The block must not fail for known faults before its constraints are checked.
    whole = replace(block, problems=(), children=tuple(_without_required(block, bad)))
    schedule = submit_with_speech(player, whole, SilentVoice())
    warnings += change_faults(block, player)
    known = {(warning.id, warning.text) for warning in warnings}
    return schedule, warnings + [w for w in schedule.warnings if (w.id, w.text) not in known]


def change_faults(block: Block, player: Player) -> Iterator[Warning]:
    """Yield the faults that changes of parameters would have while they play, if their targets are known."""
    for act in block.behaviours:
        if not isinstance(act, ParameterValueChange):
            continue
        id, behaviour = act.target
        playing = player.blocks.find(id)
        target = block if id == block.id else None if playing is None else playing.block
        node = next((n for n in target.behaviours if n.id == behaviour), None) if target else None
        try:
            if node is not None and node.tag in player.kinds:
                initial_value(act, node, player.kinds)
            elif target is not None:
                raise CommandError(f"target: wanted a behaviour of {id}, got {id}:{behaviour}")
        except CommandError as fault:
            yield located_warning(block, act.id, "EXECUTION_FAILURE", str(fault))


def _without_required(block: Block, bad: set[str]) -> Iterator[Any]:
    """Yield the children of a block, with the bad behaviours of <required> moved out of it."""
    for child in block.children:
        if not isinstance(child, Required):
            yield child
            continue
        loose: list[Behaviour] = [c for c in child.children if getattr(c, "id", None) in bad]  # type: ignore[misc]
        yield replace(child, children=tuple(c for c in child.children if c not in loose))
        yield from loose


def located_warning(block: Block, id: str, type: str, text: str) -> Warning:
    """Return a warning about a behaviour, with its place."""
    place = block.places.get(id)
    return Warning(f"{block.id}:{id}", type, text if place is None else place.with_place(text))


def without_faults(
    source: Source, items: Sequence[Block | BMLError], strict_bml: bool = False
) -> list[Block | None]:
    """Parse a text again without the attributes for which behaviours were dropped.

    Args:
        items: the results of parsing the text.
        strict_bml: how they were read.

    Returns:
        A block for each item, or None if there is nothing more to find.
    """
    problems = [p for item in items if isinstance(item, Block) for p in item.problems if p.dropped]
    spans = sorted(set(_spans(source, problems)))
    if not spans:
        return [None] * len(items)
    # Blanks keep the positions of the rest.
    parts, last = [], 0
    for start, end in spans:
        parts += [source.text[last:start], re.sub(r"[^\n]", " ", source.text[start:end])]
        last = end
    again = list(read("".join(parts) + source.text[last:], VOCABULARY, strict_bml=strict_bml))
    if len(again) != len(items):
        return [None] * len(items)
    return [item if isinstance(item, Block) else None for item in again]


def masked_faults(block: Block, whole: Block, player: Player, context: PlanningContext) -> Iterator[Warning]:
    """Yield the faults of behaviours that had been dropped from a block.

    Args:
        whole: the block from `without_faults`.
    """
    known = {node.id for node in block.behaviours}
    for node in whole.behaviours:
        kind = player.kinds.get(node.tag)
        if node.id not in known and kind is not None:
            for fault in kind.check(node, context):
                yield located_warning(whole, node.id, fault.type, fault.text)


def _spans(source: Source, problems: Iterable[Problem]) -> Iterator[tuple[int, int]]:
    """Yield the spans of attributes that problems mention, from the name to the closing quote."""
    for problem in problems:
        element = source.find(problem.path, line=problem.line, block=problem.id.partition(":")[0])
        if element is None:
            continue
        for name in attributes_of(problem.text):
            span = source.value_span(element, name)
            if span is None or name == "id":
                continue  # behaviours need an id
            tag = source.text[element.offset : span[0]]
            begun = re.search(r"[^\s\"'<>/=]+\s*=\s*[\"']$", tag)
            if begun is not None:
                yield element.offset + begun.start(), span[1] + 1
