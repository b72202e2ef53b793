"""Enrichment of texts and documents with expressions: `realizer.enrich`."""

import logging
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Self

from bml_schema import Block, BMLError, Speech, read, write
from bml_schema.escape import ILLEGAL, escape
from realizer.behaviours.registry import VOCABULARY
from realizer.behaviours.speech import UNSAID
from realizer.core.options import PlayOptions
from realizer.knowledge.enrich import Enricher, SpokenText
from realizer.knowledge.word_languages import Words, language_of
from realizer.playback.player import Player
from realizer.playback.speaking import submit_with_speech
from realizer.sources import is_file_name, is_markup, spoken
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import MAX_TEXT
from realizer.tables.emotional_words import words_of
from realizer.tables.knowledge import Role, knowledge
from realizer.text.spoken import spoken_text

ROLES = ("speaker", "listener")
MARKED = re.compile(rb"(?:\xef\xbb\xbf)?\s*<(?![\d\s])|\xff\xfe|\xfe\xff")

log = logging.getLogger(__name__)


def enrich(
    text: str | bytes | Path,
    *,
    role: Role = "speaker",
    mood: str | None = None,
    language: str | None = None,
    words: Path | str | None = None,
    plain: bool = False,
) -> str:
    """Return BML that speaks a text with expressions, or documents with further expressions.

    Problems of documents that are read in spite of them are logged as warnings.

    Args:
        text: a text, BML, or a file of either; a single word with the suffix of a file is its name.
        role: "speaker", or "listener" for the expressions of one who listens to the text.
        mood: a word such as "happy": how often expressions come and how long they last.
        language: BCP-47 tag of text without xml:lang; None: en-US.
        plain: whether a text is spoken sign by sign, without Markdown, stage directions and the like.
        words: a file of emotional words, in the format of realizer/tables/emotional_words_en.csv.

    Raises:
        BMLError: no document can be read.
        FileNotFoundError: there is no such file.
        TypeError: the text has another type.
        ValueError: an unknown role or mood, or no text.
        TableError: `words` is no list of words.
    """
    if not isinstance(text, str | bytes | Path):
        raise TypeError(f"text: wanted a text, BML, bytes or a pathlib.Path, got {type(text).__name__}")
    if isinstance(text, str) and is_file_name(text):
        text = Path(text)
    content = text.read_bytes() if isinstance(text, Path) else text
    if isinstance(content, bytes) and not MARKED.match(content):
        content = content.decode("utf-8-sig")
    if role not in ROLES:
        raise ValueError(f"role: wanted {' or '.join(ROLES)}, got {role!r}")
    try:
        feeling = None if mood is None else knowledge().mood(mood)
    except KeyError as error:
        raise ValueError(error.args[0]) from None
    own = None if words is None else words_of(Path(words))
    enricher = Enricher(role, feeling, Words(language or "en-US", own, everywhere=language is None))
    enriched = Enrichment.of(content, enricher, log.warning, plain=plain)
    if not enriched.blocks:
        raise enriched.errors[0]
    return enriched.bml


@dataclass
class Enrichment:
    """Blocks with expressions.

    Attributes:
        errors: of the documents that cannot be read.
        faults: number of faults, of these too.
        placed: number of expressions that were placed.
        languages: of the texts, each once a block.
    """

    blocks: list[Block] = field(default_factory=list)
    errors: list[BMLError] = field(default_factory=list)
    faults: int = 0
    placed: int = 0
    languages: list[str] = field(default_factory=list)

    @property
    def bml(self) -> str:
        """The documents."""
        return "".join(write(block) for block in self.blocks)

    @classmethod
    def of(
        cls, source: str | bytes, enricher: Enricher, report: Callable[[str], None], *, plain: bool = False
    ) -> Self:
        """Enrich a text or documents, and report what is left out.

        Args:
            plain: whether a text is spoken sign by sign.

        Raises:
            ValueError: there is no text.
        """
        found = cls()
        if not source.strip():
            raise ValueError("wanted a text or a BML document, got only blanks")
        if isinstance(source, bytes) or is_markup(source):
            found._add_documents(source, enricher, report)
            return found
        clean, count = ILLEGAL.subn(" ", source)
        if count:
            report(f"{count} character{'s' * (count > 1)} that XML cannot hold became blanks")
        if not clean.strip():
            raise ValueError("wanted a text or a BML document, got characters XML cannot hold")
        if not plain:
            said = spoken_text(clean, enricher.words.language)
            if said.markup != escape(said):  # behaviours, or SSML; its speech says what is left out
                found._add_documents(spoken(clean, language=enricher.words.language), enricher, report)
                return found
            for warning in said.warnings:
                report(warning)
            clean = said.text
            if not clean:
                raise ValueError("wanted a text or a BML document, got nothing that can be spoken")
        found.blocks += enricher.texts(clean, MAX_TEXT)
        found.placed = sum(map(_count_placed, found.blocks))
        found.languages = [enricher.words.language]
        return found

    def _add_documents(self, text: str | bytes, enricher: Enricher, report: Callable[[str], None]) -> None:
        for item in read(text, VOCABULARY):
            problems = item.problems if isinstance(item, Block) else (item,)
            for problem in problems:
                report(f"realizer: {problem}")
            self.faults += len(problems)
            if not isinstance(item, Block):
                self.errors.append(item)
                continue
            item = _without_remarks(item, report)
            self.languages += languages_in(item, enricher.words)
            if enricher.role == "speaker":
                for node in item.behaviours:
                    if isinstance(node, Speech) and node.text is not None and node.descriptions:
                        report(
                            f"{item.id}:{node.id}: a description may be spoken instead of its text; skipped"
                        )
                self.blocks.append(enricher.block(item))
                self.placed += _count_placed(self.blocks[-1]) - _count_placed(item)
            else:
                texts = _spoken_texts(item, enricher.words.language)
                self.blocks.append(enricher.listener(texts, f"{item.id}-listener"))
                self.placed += _count_placed(self.blocks[-1])


def _without_remarks(block: Block, report: Callable[[str], None]) -> Block:
    """Report what of a text is not in the words of its speech, and return the block without these remarks."""
    children = []
    for node in block.children:
        attributes = dict(node.unknown_attributes) if isinstance(node, Speech) else {}
        if isinstance(node, Speech) and (left_out := attributes.pop(UNSAID, "")):
            report(left_out)
            if node.text is not None and not node.text.parts:  # it only carries the remark
                continue
            node = replace(node, unknown_attributes=attributes)
        children.append(node)
    return replace(block, children=tuple(children))


def languages_in(block: Block, words: Words) -> list[str]:
    """Return the languages of the speeches of a block, each once."""
    speeches = [node for node in block.behaviours if isinstance(node, Speech)]
    return list(dict.fromkeys(language_of(node, block, words.language) for node in speeches))


def _count_placed(block: Block) -> int:
    return sum(bool(getattr(node, "because", "")) for node in block.behaviours)


def _spoken_texts(block: Block, language: str) -> Iterable[SpokenText]:
    """Return the texts of a block in the order in which they are scheduled."""
    player = Player(PlayOptions(language=language), animates=False)
    times = submit_with_speech(player, block, SilentVoice()).times
    texts = [
        SpokenText(str(node.text), float(times[node.id][0]), language_of(node, block, language))
        for node in block.behaviours
        if isinstance(node, Speech) and node.text is not None and node.id in times
    ]
    return sorted(texts, key=lambda text: text.begin)
