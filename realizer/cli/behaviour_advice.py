"""Advice from the knowledge base about the expressions of a block, as findings."""

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
    """Yield advice on expressions whose duration, order or words are unusual for people.

    Args:
        utterances: speech id -> utterance.
        lists: the emotional words.
    """
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
        yield Finding(file, ADVICE, id, path, text, advice.text, (label,), notes)
