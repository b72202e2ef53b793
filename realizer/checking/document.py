"""The check of a document: every fault of every block."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from bml_schema import Behaviour, Block, Required, read
from bml_schema.source import Source
from realizer.behaviours.registry import VOCABULARY
from realizer.checking.explain import finding_of
from realizer.checking.finding import Finding
from realizer.checking.masked_faults import located_warning, masked_faults, without_faults
from realizer.playback.feedback_events import parse_warning
from realizer.playback.player import Player
from realizer.playback.speaking import submit_with_speech, synthesize
from realizer.scheduling.timing import Schedule, Warning
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import Utterance


@dataclass(frozen=True)
class CheckedBlock:
    """A block, or a stretch of text that is none, and its faults.

    Attributes:
        findings: in order of their places.
        block, schedule: None where nothing could be read.
        utterances: the silent voice's utterances of its speeches.
    """

    findings: tuple[Finding, ...]
    block: Block | None = None
    schedule: Schedule | None = None
    utterances: Mapping[str, Utterance] = field(default_factory=dict)


def check_document(file: str, source: Source, text: bytes | str, player: Player) -> Iterator[CheckedBlock]:
    """All blocks of a document, in order.

    Args:
        file: as the user named it.
        source: of the text.
        player: gets every block, so that later ones may refer to earlier ones.
    """
    voice = SilentVoice()
    items = list(read(text, VOCABULARY))
    for item, whole in zip(items, without_faults(source, items), strict=True):
        if isinstance(item, Block):
            said = synthesize(player.speech_requests(item), voice)
            schedule, warnings = check_block(item, player, said)
            if whole is not None:
                warnings += masked_faults(item, whole, player, replace(player.context, utterances=dict(said)))
            yield CheckedBlock(_explained(file, source, warnings), item, schedule, said)
        else:
            yield CheckedBlock(_explained(file, source, [parse_warning(item)]))


def _explained(file: str, source: Source, warnings: list[Warning]) -> tuple[Finding, ...]:
    findings = [finding_of(file, source, warning, VOCABULARY) for warning in warnings]
    return tuple(sorted(findings, key=lambda finding: finding.spot or (0,)))


def check_block(
    block: Block, player: Player, utterances: Mapping[str, Utterance]
) -> tuple[Schedule, list[Warning]]:
    """The schedule of a block, and everything that is wrong with it, also where one fault ends it all.

    Args:
        utterances: the silent voice's utterances of its speeches.
    """
    warnings = [Warning(p.id, p.type, str(p)) for p in block.problems]
    world = replace(player.context, utterances=dict(utterances))
    bad: set[str] = set()
    for node in block.behaviours:
        kind = player.kinds.get(node.tag)
        faults = kind.check(node, world) if kind is not None else ()
        warnings += [located_warning(block, node.id, fault.type, fault.text) for fault in faults]
        if any(fault.fatal for fault in faults):
            bad.add(node.id)
    # Reported faults must not end the block before its constraints are checked.
    whole = replace(block, problems=(), children=tuple(_without_required(block, bad)))
    schedule = submit_with_speech(player, whole, SilentVoice())
    told = {(warning.id, warning.text) for warning in warnings}
    return schedule, warnings + [w for w in schedule.warnings if (w.id, w.text) not in told]


def _without_required(block: Block, bad: set[str]) -> Iterator[Any]:
    """The children of a block, with the bad behaviours of <required> outside of it."""
    for child in block.children:
        if not isinstance(child, Required):
            yield child
            continue
        loose: list[Behaviour] = [c for c in child.children if getattr(c, "id", None) in bad]  # type: ignore[misc]
        yield replace(child, children=tuple(c for c in child.children if c not in loose))
        yield from loose
