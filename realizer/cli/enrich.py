"""`enrich`: adds expressions of the knowledge base to a text or to documents."""

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

FILES = (".bml", ".xml", ".txt")  # a single word that ends so is meant to be a file
MARKUP = re.compile(r"\s*<(?!\d)[\w:?!/]")  # "<3" is none
# What XML 1.0 has no way to write (production 2, Char).
UNWRITABLE = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")


class MoodWord(click.ParamType):  # type: ignore[type-arg]
    """A word of the table of moods."""

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
    help="Whether the face talks, or listens to what is said.",
)
mood = click.option(
    "--mood",
    type=MoodWord(),
    metavar="WORD",
    help="How often, and for how long, expressions come: sad, happy.",
)


language = click.option(
    "--language", metavar="BCP-47", help="Of what is said, where no xml:lang says it.  [default: en-US]"
)
words = click.option(
    "--words",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE.csv",
    help="Emotional words of your own, for texts in --language or for all: lines # source:, # units:,"
    " # licence: and word,category,origin, as in realizer/tables/emotional_words_en.csv.",
)


def words_for(language: str | None, file: Path | None) -> Words:
    """The words that count.

    Raises:
        click.UsageError: a file that is no list of words.
    """
    from realizer.core.errors import TableError
    from realizer.knowledge.word_languages import Words
    from realizer.tables.emotional_words import words_of

    try:
        own = words_of(file) if file is not None else None
    except TableError as error:
        raise click.UsageError(str(error)) from None
    return Words(options.settings(language=language).language, own, everywhere=language is None)


def warn_unknown_languages(words: Words, languages: Iterable[str], warned: set[str]) -> None:
    """A word on standard error for each language without a list of words that is not told yet."""
    for language in languages:
        if language not in warned and words.of(language) is None:
            warned.add(language)
            click.echo(
                f"no emotional words for language {language!r}: none of its words counts; see --words",
                err=True,
            )


def languages_in(block: Block, words: Words) -> list[str]:
    """The languages of what is said in a block, each once."""
    from bml_schema import Speech
    from realizer.knowledge.word_languages import language_of

    said = [node for node in block.behaviours if isinstance(node, Speech)]
    return list(dict.fromkeys(language_of(node, block, words.language) for node in said))


@click.command()
@click.argument("text", metavar="TEXT|FILE|-")
@role
@mood
@language
@words
@click.option(
    "-o", "--output", metavar="OUT.bml", type=click.Path(path_type=Path), help="Default: standard output."
)
@click.pass_context
def enrich(
    context: click.Context,
    text: str,
    role: Any,
    mood: Any,
    language: str | None,
    words: Path | None,
    output: Path | None,
) -> int:
    """Give a text the face of who says it: BML with expressions at its words (Wojdel 2005, 6.5).

    TEXT is what is said, a file of it, or a BML document, whose speeches and expressions get what goes with
    them. Each expression says in `because` which rule placed it. The expressions are her templates.

    \b
    realizer enrich "Are you sure? That is nonsense!" -o sure.bml
    realizer realize sure.bml -o sure.mp4
    """
    from bml_schema import write
    from realizer.knowledge.enrich import Enricher
    from realizer.speech.utterance import MAX_TEXT

    said = _read(text)
    if not said.strip():
        raise click.UsageError("wanted a text or a BML document, got nothing but blanks")
    lists = words_for(language, words)
    enricher = Enricher(role, mood, lists)
    faults = 0
    before = 0
    if isinstance(said, bytes) or MARKUP.match(said):
        blocks, before, faults, languages = _documents(said, enricher)
    else:
        clean = _writable(said)
        if not clean.strip():
            raise click.UsageError("wanted a text or a BML document, got nothing that can be said")
        blocks = list(enricher.texts(clean, MAX_TEXT))
        languages = [lists.language]
    if not context.obj["quiet"]:
        warn_unknown_languages(lists, languages, set())
        if language is None and words is None and _is_foreign(said, lists.language):
            click.echo(
                f"none of this is in the letters of {lists.language!r}, so that none of its words counts; see"
                " --language and --words",
                err=True,
            )
    result = "".join(write(block) for block in blocks)
    if output is None:
        sys.stdout.write(result)
    else:
        output.write_text(result, "utf-8")
        placed = sum(map(_count_placed, blocks)) - before
        click.echo(f"{output}: {placed} expression{'s' * (placed != 1)} placed", err=True)
    return 1 if faults else 0


def _is_foreign(said: str | bytes, language: str) -> bool:
    """Whether a text that is taken for English has letters, and none of them are English ones."""
    if isinstance(said, bytes) or language.partition("-")[0].lower() != "en":
        return False
    letters = [letter for letter in said if letter.isalpha()]
    return bool(letters) and not any(letter.isascii() for letter in letters)


def _count_placed(block: Block) -> int:
    """How many expressions of a block say which rule placed them."""
    return sum(bool(getattr(node, "because", "")) for node in block.behaviours)


def _read(text: str) -> str | bytes:
    """The text itself, or what a file or standard input holds; XML, which names its encoding, as bytes.

    Raises:
        click.UsageError: what looks like the name of a file, and is none; a text that is not UTF-8.
    """
    try:
        is_file = text == "-" or Path(text).is_file()
        is_folder = Path(text).is_dir() and os.sep in text
    except (OSError, ValueError):  # too long for a name
        is_file = is_folder = False
    if not is_file:
        if is_folder or (not text.split()[1:] and text.lower().rstrip().endswith(FILES)):
            raise click.UsageError(f"{text}: wanted a text, or a file that is there; a text may come by -")
        return text
    data = options.read_documents([text])[0]
    if re.match(rb"(?:\xef\xbb\xbf)?\s*<(?![\d\s])", data) or data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return data
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        name = "standard input" if text == "-" else text
        raise click.UsageError(
            f"{name}: wanted a text in UTF-8, got byte 0x{data[error.start]:02X} at {error.start}"
        ) from None


def _writable(text: str) -> str:
    """The text with blanks for characters that XML has no way to write; how many is told."""
    clean, count = UNWRITABLE.subn(" ", text)
    if count:
        click.echo(f"{count} character{'s' * (count > 1)} that XML cannot hold became blanks", err=True)
    return clean


def _documents(text: str | bytes, enricher: Enricher) -> tuple[list[Block], int, int, list[str]]:
    """Blocks of documents, enriched; how many expressions they had before; faults told; languages.

    A broken document is left out.
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
                        f"{item.id}:{node.id}: a description may be spoken instead of its text, where no mark"
                        " of ours is: nothing is placed in it",
                        err=True,
                    )
            before += _count_placed(item)
            blocks.append(enricher.block(item))
        else:
            heard = _spoken_texts(item, enricher.words.language)
            blocks.append(enricher.listener(heard, f"{item.id}-listener"))
    return blocks, before, faults, languages


def _spoken_texts(block: Block, language: str) -> list[SpokenText]:
    """The texts of a block, each when it begins as the block is scheduled."""
    from bml_schema import Speech
    from realizer.knowledge.enrich import SpokenText
    from realizer.knowledge.word_languages import language_of
    from realizer.playback.player import Player
    from realizer.playback.speaking import submit_with_speech
    from realizer.speech.silent import SilentVoice

    times = submit_with_speech(Player(PlayOptions(language=language)), block, SilentVoice()).times
    said = [
        SpokenText(str(node.text), float(times[node.id][0]), language_of(node, block, language))
        for node in block.behaviours
        if isinstance(node, Speech) and node.text is not None and node.id in times
    ]
    return sorted(said, key=lambda one: one.begin)
