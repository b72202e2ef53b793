"""`enrich`: adds expressions from the knowledge base to a text or to documents."""

from __future__ import annotations

import os
import re
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import options
from realizer.core.options import PlayOptions

if TYPE_CHECKING:
    from bml_schema import Block
    from realizer.knowledge.enrich import Enricher, SpokenText
    from realizer.knowledge.word_languages import Words

FILES = (".bml", ".xml", ".txt")  # suffixes of a single word that is meant to be a file name
MARKUP = re.compile(r"\s*<(?!\d)[\w:?!/]")  # but not "<3"
# Characters that XML 1.0 cannot contain (production 2, Char).
UNWRITABLE = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


class MoodWord(click.ParamType):  # type: ignore[type-arg]
    """A mood of the knowledge base."""

    name = "mood"

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> Any:
        from realizer.tables.knowledge import knowledge

        try:
            return knowledge().mood(value)
        except KeyError as error:
            self.fail(error.args[0].removeprefix("mood: "), parameter, context)


role = click.option(
    "--role",
    type=click.Choice(["speaker", "listener"]),
    default="speaker",
    show_default=True,
    help="Whether the face speaks the text or listens to it.",
)
mood = click.option(
    "--mood",
    type=MoodWord(),
    metavar="WORD",
    help="Mood, such as happy or sad: how often expressions come and how long they last.",
)
language = click.option(
    "--language", metavar="TAG", help="Language of text without xml:lang, as a BCP-47 tag.  [default: en-US]"
)
words = click.option(
    "--words",
    type=options.FILE,
    metavar="FILE.csv",
    help="Your own emotional words, for texts in --language, or for all texts without it; the format is that "
    "of realizer/tables/emotional_words_en.csv.",
)


def words_for(language: str | None, file: Path | None) -> Words:
    """Return the emotional words to use.

    Raises:
        click.UsageError: the file is not a list of words.
    """
    from realizer.core.errors import TableError
    from realizer.knowledge.word_languages import Words
    from realizer.tables.emotional_words import words_of

    with options.reporting(TableError):
        own = words_of(file) if file is not None else None
    return Words(options.settings(language=language).language, own, everywhere=language is None)


def warn_unknown_languages(words: Words, languages: Iterable[str], warned: set[str]) -> None:
    """Print a warning for each language without emotional words, once, and add it to `warned`."""
    for language in languages:
        if language not in warned and words.of(language) is None:
            warned.add(language)
            click.echo(
                f"no emotional words for language {language!r}: only punctuation counts; see --words",
                err=True,
            )


def languages_in(block: Block, words: Words) -> list[str]:
    """Return the languages of the speeches of a block, each once."""
    from bml_schema import Speech
    from realizer.knowledge.word_languages import language_of

    speeches = [node for node in block.behaviours if isinstance(node, Speech)]
    return list(dict.fromkeys(language_of(node, block, words.language) for node in speeches))


@click.command()
@click.argument("text", metavar="TEXT|FILE|-")
@role
@mood
@language
@words
@click.option(
    "-o", "--output", metavar="OUT.bml", type=options.OUTPUT, help="File to write.  [default: print it]"
)
def enrich(
    text: str, role: Any, mood: Any, language: str | None, words: Path | None, output: Path | None
) -> int:
    """Add facial expressions to a text or a BML document (Wojdel 2005, 6.5).

    A text becomes a BML document that speaks it, with expressions at words and sentence ends; in a document,
    speeches and expressions get the expressions that usually accompany them. The attribute `because` of each
    added expression names the rule that placed it.

    \b
    realizer enrich "Are you sure? That is nonsense!" -o sure.bml
    realizer realize sure.bml -o sure.mp4
    """
    from bml_schema import write
    from realizer.knowledge.enrich import Enricher
    from realizer.speech.utterance import MAX_TEXT

    source = _read(text)
    if not source.strip():
        raise click.UsageError("wanted a text or a BML document, got only blanks")
    lists = words_for(language, words)
    enricher = Enricher(role, mood, lists)
    faults = before = 0
    if isinstance(source, bytes) or MARKUP.match(source):
        blocks, before, faults, languages = _enrich_documents(source, enricher)
    else:
        clean = _replace_unwritable(source)
        if not clean.strip():
            raise click.UsageError("wanted a text or a BML document, got characters XML cannot hold")
        blocks = list(enricher.texts(clean, MAX_TEXT))
        languages = [lists.language]
    if not options.is_quiet():
        warn_unknown_languages(lists, languages, set())
    if language is None and words is None and _is_foreign(source, lists.language):
        options.note(
            f"this text has no letters of {lists.language!r}, so only punctuation counts; see --language and "
            "--words"
        )
    result = "".join(write(block) for block in blocks)
    if output is None:
        sys.stdout.write(result)
    else:
        output.write_text(result, "utf-8")
        placed = sum(map(_count_placed, blocks)) - before
        options.note(f"{output}: {placed} expression{'s' * (placed != 1)} placed")
    return 1 if faults else 0


def _is_foreign(text: str | bytes, language: str) -> bool:
    """Return whether a text that is taken for English has letters, but no English ones."""
    if isinstance(text, bytes) or language.partition("-")[0].lower() != "en":
        return False
    letters = [letter for letter in text if letter.isalpha()]
    return bool(letters) and not any(letter.isascii() for letter in letters)


def _count_placed(block: Block) -> int:
    """Return the number of expressions that a rule has placed."""
    return sum(bool(getattr(node, "because", "")) for node in block.behaviours)


def _read(text: str) -> str | bytes:
    """Return the text, or the content of the file or standard input; XML, which names its encoding, as bytes.

    Raises:
        click.UsageError: a missing file, or a text that is not UTF-8.
    """
    try:
        is_file = text == "-" or Path(text).is_file()
        is_folder = Path(text).is_dir() and os.sep in text
    except (OSError, ValueError):  # too long for a name
        is_file = is_folder = False
    if not is_file:
        if is_folder or (not text.split()[1:] and text.lower().rstrip().endswith(FILES)):
            raise click.UsageError(f"{text}: wanted a text or an existing file; - reads standard input")
        return text
    (data,) = options.read_documents([text])
    if re.match(rb"(?:\xef\xbb\xbf)?\s*<(?![\d\s])", data) or data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data
    return options.decode(data, text, "a text")


def _replace_unwritable(text: str) -> str:
    """Replace characters that XML cannot contain by blanks and print how many."""
    clean, count = UNWRITABLE.subn(" ", text)
    if count:
        click.echo(f"{count} character{'s' * (count > 1)} that XML cannot hold became blanks", err=True)
    return clean


def _enrich_documents(text: str | bytes, enricher: Enricher) -> tuple[list[Block], int, int, list[str]]:
    """Enrich documents and print their faults; broken documents are left out.

    Returns:
        The blocks, the number of expressions placed before, the number of faults, and the languages.
    """
    from bml_schema import Block, Speech, read
    from realizer.behaviours.registry import VOCABULARY

    blocks: list[Block] = []
    languages: list[str] = []
    before = faults = 0
    for item in read(text, VOCABULARY):
        problems = item.problems if isinstance(item, Block) else (item,)
        for problem in problems:
            click.echo(f"realizer: {problem}", err=True)
            faults += 1
        if not isinstance(item, Block):
            continue
        languages += languages_in(item, enricher.words)
        if enricher.role == "speaker":
            for node in item.behaviours:
                if isinstance(node, Speech) and node.text is not None and node.descriptions:
                    click.echo(
                        f"{item.id}:{node.id}: a description may be spoken instead of its text; skipped",
                        err=True,
                    )
            before += _count_placed(item)
            blocks.append(enricher.block(item))
        else:
            texts = _spoken_texts(item, enricher.words.language)
            blocks.append(enricher.listener(texts, f"{item.id}-listener"))
    return blocks, before, faults, languages


def _spoken_texts(block: Block, language: str) -> list[SpokenText]:
    """Return the texts of a block in the order in which they are scheduled."""
    from bml_schema import Speech
    from realizer.knowledge.enrich import SpokenText
    from realizer.knowledge.word_languages import language_of
    from realizer.playback.player import Player
    from realizer.playback.speaking import submit_with_speech
    from realizer.speech.silent import SilentVoice

    times = submit_with_speech(
        Player(PlayOptions(language=language), animates=False), block, SilentVoice()
    ).times
    texts = [
        SpokenText(str(node.text), float(times[node.id][0]), language_of(node, block, language))
        for node in block.behaviours
        if isinstance(node, Speech) and node.text is not None and node.id in times
    ]
    return sorted(texts, key=lambda text: text.begin)
