"""Advice of the knowledge base on the expressions of a block, as findings."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from bml_schema import Block, Speech
from bml_schema.source import Source
from realizer.checking.advice import ADVICE
from realizer.checking.finding import Finding, Label
from realizer.knowledge.advice import VisibleExpression, advise
from realizer.knowledge.enrich import template_of
from realizer.speech.words import words_in

if TYPE_CHECKING:
    from realizer.knowledge.word_languages import Words
    from realizer.scheduling.timing import Schedule
    from realizer.speech.utterance import Utterance
    from realizer.tables.knowledge import Mood, Role


def advise_on_behaviours(
    file: str,
    source: Source,
    block: Block,
    schedule: Schedule,
    utterances: Mapping[str, Utterance],
    role: Role,
    mood: Mood | None,
    lists: Words,
) -> Iterator[Finding]:
    """Expressions that last, follow each other or accompany words otherwise than people's do.

    Args:
        schedule: of the block.
        utterances: what a voice made of its speeches.
        lists: the words that count.
    """
    seen = [
        VisibleExpression(node.id, template, (start + peak) / 2, (relax + end) / 2)
        for node in block.behaviours
        if (template := template_of(node)) and node.id in schedule.times
        for start, peak, relax, end in [schedule.times[node.id].tolist()]
    ]
    words = {}
    for node in block.behaviours:
        if isinstance(node, Speech) and node.id in schedule.times and node.id in utterances:
            places = [place for _, place in words_in(str(node.text or ""))]
            spoken = utterances[node.id].words
            # A description may say something else than the text; when which word of that comes nobody knows.
            if len(places) == len(spoken):
                begin = float(schedule.times[node.id][0])
                words[node.id] = [(p, begin + w.start) for p, w in zip(places, spoken, strict=True)]
    for one in advise(block, seen, words, role, mood, lists):
        where = block.places.get(one.id)
        path, line = (where.path, where.line) if where is not None else ("/bml", None)
        spot = source.locate(path, line=line, block=block.id)
        id = f"{block.id}:{one.id}" if one.id else block.id
        whole = f"{one.text}; {one.hint}"
        yield Finding(file, ADVICE, id, path, whole, one.text, (Label(spot, ""),), (f"help: {one.hint}",))
