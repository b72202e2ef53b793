"""Addition of expressions to a text or a block, by the rules of the knowledge base."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import count
from typing import NamedTuple

from bml_schema import Block, Expression, Speech, Sync, SyncRef
from bml_schema.behaviours import SpeechText
from realizer.knowledge.placement_rules import Placement, place_expressions
from realizer.knowledge.sentences import sentences
from realizer.knowledge.word_languages import ENGLISH, Words, language_of
from realizer.tables.knowledge import CompanionRule, Knowledge, Mood, Role, knowledge
from realizer.tables.templates import PREFIX, Template, apex, templates

MIN_PIECE = 500  # characters; shorter texts are not split
# Characters that a mark and an escape add to the text for a voice.
MARK, ESCAPE = len('<mark name="w1234"/>'), len("&amp;") - 1
OPENING = "\"'“‘„«‹([¿¡"
INTENSITY = 0.7  # of placed expressions, as people do not talk with a full face
MIN_LEAD = 0.2  # s; expressions that would be shorter are not placed


def template_of(node: object) -> str:
    """Return the template that a behaviour shows, in lower case, or ""."""
    name = node.name.lower() if isinstance(node, Expression) else ""
    if not name.startswith(PREFIX):
        return ""
    return " ".join(name.removeprefix(PREFIX).replace("-", " ").replace("_", " ").split())


class SpokenText(NamedTuple):
    """A text, the second at which it begins, and its language (BCP-47)."""

    text: str
    begin: float
    language: str


@dataclass(frozen=True)
class Enricher:
    """Adds expressions to texts and blocks for a character."""

    role: Role = "speaker"  # whether the character speaks or listens
    mood: Mood | None = None  # mood of the character; None: average
    words: Words = ENGLISH  # emotional words, and the default language
    rules: Knowledge = field(default_factory=knowledge)  # the rules to apply
    # Templates whose usual durations placed expressions have; None: those of the player.
    durations: Mapping[str, Template] | None = None

    def text(self, text: str, block: str = "bml1") -> Block:
        """Return a block that speaks a text with expressions, or shows a listener to it."""
        if self.role == "listener":
            return self.listener((SpokenText(text, 0.0, self.words.language),), block)
        named = "" if self.words.everywhere else self.words.language
        speech = Speech(id="speech1", text=SpeechText(parts=(text,), language=named))
        return self.block(Block(id=block, children=(speech,)))

    def texts(self, text: str, longest: int) -> Iterator[Block]:
        """Yield blocks for a long text, split between sentences, each appended to the one before.

        `longest` is the largest number of characters for a voice, marks included.
        """
        for number, block in enumerate(self._short(text, longest, longest // 2), 1):
            yield replace(block, id=f"bml{number}", composition="APPEND" if number > 1 else "MERGE")

    def _short(self, text: str, longest: int, most: int) -> Iterator[Block]:
        """Yield blocks of at most `most` characters; of fewer if their marks make them too long."""
        for piece in _pieces(text, self.words.language, most):
            block = self.text(piece)
            if most > MIN_PIECE and any(_length(node) > longest for node in block.behaviours):
                yield from self._short(piece, longest, most // 2)
            else:
                yield block

    def block(self, block: Block) -> Block:
        """Return a speaker's block with expressions at words, and companions of all its expressions.

        Enriching a block twice adds nothing.
        """
        names = _IdFactory(block)
        speeches: dict[str, Speech] = {}
        placed: list[Expression] = []
        for node in block.behaviours:
            if isinstance(node, Speech) and node.text is not None and not node.descriptions:
                speeches[node.id], shown = self._speech(node, block, names)
                placed += shown
        shown_now = [node for node in block.behaviours if isinstance(node, Expression)] + placed
        for node in list(shown_now):
            placed += self._company(node, shown_now, names)
        marked = block.with_children(
            lambda node, _: speeches.get(node.id, node) if isinstance(node, Speech) else node
        )
        return replace(marked, children=(*marked.children, *placed), places={})

    def listener(self, texts: Iterable[SpokenText], block: str) -> Block:
        """Return a block of expressions for a listener to these texts."""
        names = _IdFactory(Block(id=block))
        placed: list[Expression] = []
        for text, begin, language in texts:
            for placement in self._placements(text, language):
                for name in placement.rule.show:
                    start = SyncRef(offset=round(begin + placement.word.start, 3))
                    placed.append(self._expression(name, start, placement.rule.says, names))
        for node in list(placed):
            placed += self._company(node, placed, names)
        return Block(id=block, children=tuple(placed))

    def _placements(self, text: str, language: str) -> tuple[Placement, ...]:
        words = self.words.of(language)
        return place_expressions(sentences(text, language), self.rules, self.role, self.mood, words)

    def _speech(self, node: Speech, block: Block, names: _IdFactory) -> tuple[Speech, list[Expression]]:
        """Return the speech with marks, and the expressions that begin at them."""
        assert node.text is not None
        marks = _marks(node.text.parts)
        begun = {(str(e.syncs.get("start")), template_of(e)) for e in block.behaviours}
        placed = []
        new: dict[int, str] = {}
        language = language_of(node, block, self.words.language)
        for placement in self._placements(str(node.text), language):
            at = placement.word.place
            id = marks.get(at) or new.get(at) or names.mark(node)
            start = SyncRef(behaviour=node.id, sync=id)
            shown = [name for name in placement.rule.show if (str(start), name) not in begun]
            beyond = placement.rule.outlasts
            end = SyncRef(behaviour=node.id, sync="end", offset=beyond) if beyond else None
            placed += [self._expression(name, start, placement.rule.says, names, end) for name in shown]
            if shown and at not in marks:
                new[at] = id
        return replace(node, text=replace(node.text, parts=_marked(node.text.parts, new))), placed

    def _expression(
        self, name: str, start: SyncRef, because: str, names: _IdFactory, end: SyncRef | None = None
    ) -> Expression:
        id = names.behaviour(name)
        syncs: dict[str, SyncRef] = {"start": start}
        if end is not None:
            syncs["end"] = end
        elif self.mood is not None or self.durations is not None:
            known = {**templates(), **(self.durations or {})}.get(name.upper())
            if known is not None:  # rules of one's own may show others
                held = _hold_seconds(known, self.mood.length if self.mood else 1.0)
                syncs["relax"] = SyncRef(behaviour=id, sync="attackPeak", offset=round(held, 3))
        return Expression(id=id, name=PREFIX + name, intensity=INTENSITY, because=because, syncs=syncs)

    def _company(
        self, node: Expression, beside: Sequence[Expression], names: _IdFactory
    ) -> Iterator[Expression]:
        """Yield the accompanying expressions that are missing."""
        for company in self.rules.companies:
            if company.offered or company.of != template_of(node):
                continue
            if any(template_of(e) == company.other and _refers(e, node.id) for e in beside):
                continue
            start, end = _around(node, company)
            if start is not None:
                other = self._expression(company.other, start, company.says, names, end)
                yield replace(other, intensity=node.intensity)


def _length(node: object) -> int:
    """Return the approximate number of characters of a speech for a voice, or 0."""
    if not isinstance(node, Speech) or node.text is None:
        return 0
    text = str(node.text)
    marks = len(node.text.parts) // 2 + 1
    return len(text) + MARK * marks + ESCAPE * sum(map(text.count, "&<>"))


def _pieces(text: str, language: str, longest: int) -> Iterator[str]:
    """Split a text into pieces of at most `longest` characters, between sentences or else words."""
    begin = 0
    if len(text) > longest:
        said = sentences(text, language)
        starts = [sentence.words[0].place for sentence in said]
        words = [word.place for sentence in said for word in sentence.words]
        while len(text) - begin > longest:
            most = begin + longest
            cut = next((at for at in (_last(starts, most), _last(words, most)) if at > begin), most)
            while cut - 1 > begin and text[cut - 1] in OPENING:
                cut -= 1
            yield text[begin:cut]
            begin = cut
    yield text[begin:]


def _last(rising: Sequence[int], most: int) -> int:
    """Return the last number up to `most`, or 0."""
    found = bisect_right(rising, most)
    return rising[found - 1] if found else 0


class _IdFactory:
    """Makes new ids for a block."""

    def __init__(self, block: Block) -> None:
        self.used = {node.id for node in block.behaviours}
        self.numbers: dict[str, Iterator[int]] = {}

    def behaviour(self, stem: str) -> str:
        return self._new(stem.replace(" ", "-"))

    def mark(self, speech: Speech) -> str:
        self.used.update((*speech.marked, *speech.sync_points))
        return self._new("w")

    def _new(self, stem: str) -> str:
        numbers = self.numbers.setdefault(stem, count(1))
        id = next(id for number in numbers if (id := f"{stem}{number}") not in self.used)
        self.used.add(id)
        return id


def _around(node: Expression, company: CompanionRule) -> tuple[SyncRef | None, SyncRef | None]:
    """Return start and end of the other expression; start is None if there is no room."""

    def point(sync: str, offset: float = 0.0) -> SyncRef:
        return SyncRef(behaviour=node.id, sync=sync, offset=offset)

    begin = node.syncs.get("start")
    room = begin.offset if begin is not None and begin.behaviour is None else company.lead
    lead = min(company.lead, room)
    if company.by == "around":
        return point("start", -lead), point("end", company.lead)
    if company.by == "before":
        return (point("start", -lead) if lead >= MIN_LEAD else None), point("attackPeak")
    if company.by == "after":
        return point("relax"), None
    return point("start"), point("end")


def _refers(node: Expression, id: str) -> bool:
    return any(ref.behaviour == id for ref in node.syncs.values())


def _hold_seconds(template: Template, length: float) -> float:
    """Return the seconds from attackPeak to relax for `length` times the usual duration."""
    seen = template.evident * length
    if template.possible is not None:
        seen = min(max(seen, template.possible[0]), template.possible[1])
    return apex(seen)


def _marks(parts: Sequence[str | Sync]) -> dict[int, str]:
    """Return place in the text -> id of each mark; the place is after the blanks that follow the mark."""
    found: dict[int, str] = {}
    at = 0
    for part, following in zip(parts, (*parts[1:], ""), strict=False):
        if isinstance(part, str):
            at += len(part)
        else:
            blanks = len(following) - len(following.lstrip()) if isinstance(following, str) else 0
            found[at + blanks] = part.id
    return found


def _marked(parts: Sequence[str | Sync], new: Mapping[int, str]) -> tuple[str | Sync, ...]:
    """Insert marks (place in the text -> id) into the parts of a text."""
    found: list[str | Sync] = []
    at = 0
    for part in parts:
        if not isinstance(part, str):
            found.append(part)
            continue
        cut = 0
        for spot in sorted(spot for spot in new if at <= spot < at + len(part)):
            if spot > at + cut:
                found.append(part[cut : spot - at])
            found.append(Sync(id=new[spot]))
            cut = spot - at
        found.append(part[cut:])
        at += len(part)
    return tuple(found)
