"""`enrich`: adds expressions from the knowledge base to a text or to documents."""

from __future__ import annotations

import sys
from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import inputs, options
from realizer.cli.options import option
from realizer.cli.progress import is_quiet, note
from realizer.core.errors import TableError

if TYPE_CHECKING:
    from realizer.knowledge.word_languages import Words
    from realizer.tables.knowledge import Knowledge
    from realizer.tables.templates import Template


class MoodWord(click.ParamType):  # type: ignore[type-arg]
    """A mood of the knowledge base."""

    name = "mood"

    def convert(self, value: Any, parameter: click.Parameter | None, context: click.Context | None) -> Any:
        folder = context.params.get("knowledge") if context is not None else None
        try:
            return rules_for(folder if isinstance(folder, Path) else None)[0].mood(value)
        except KeyError as error:
            self.fail(error.args[0].removeprefix("mood: "), parameter, context)


role = option(
    "--role",
    "Whether the face speaks the text or listens to it.",
    click.Choice(["speaker", "listener"]),
    default="speaker",
)
mood = option(
    "--mood WORD",
    "Mood, such as happy or sad: how often expressions come and how long they last.",
    MoodWord(),
    shell_complete=options.completing("realizer.tables.knowledge:knowledge", "moods"),
)
words = option(
    "--words FILE.csv",
    "Your own emotional words, for texts in --language, or for all texts without it; the format is that "
    "of realizer/tables/emotional_words_en.csv.",
    options.FILE,
)


def words_for(language: str | None, file: Path | None) -> Words:
    """Return the emotional words to use."""
    from realizer.knowledge.word_languages import Words
    from realizer.tables.emotional_words import words_of

    with inputs.reporting(TableError):
        own = words_of(file) if file is not None else None
    return Words(inputs.settings(language=language).language, own, everywhere=language is None)


def warn_unknown_languages(words: Words, languages: Iterable[str], warned: set[str]) -> None:
    """Print a warning for each language without emotional words, once, and add it to `warned`."""
    for language in languages:
        if language not in warned and words.of(language) is None:
            warned.add(language)
            click.echo(
                f"no emotional words for language {language!r}: only punctuation counts; see --words",
                err=True,
            )


def rules_for(folder: Path | None) -> tuple[Knowledge, Mapping[str, Template] | None]:
    """Return the rules and templates in a folder of `realizer corpus describe`, or ours and None."""
    from realizer.tables import knowledge, templates

    if folder is None:
        return knowledge.knowledge(), None
    with inputs.reporting(TableError):
        durations = folder / templates.FILE
        return (
            knowledge.read_knowledge(folder / knowledge.FILE),
            templates.read_templates(durations) if durations.is_file() else None,
        )


@click.command()
@click.argument("text", metavar="TEXT|FILE|-")
@role
@mood
@options.language
@words
@option(
    "--knowledge DIR",
    "Folder with the rules (knowledge.toml) and durations (templates.toml) to use, as written by "
    "`realizer corpus describe`.",
    options.FOLDER,
    is_eager=True,
)
@option(
    "--plain", "Speak a TEXT sign by sign, without Markdown, stage directions and the like.", is_flag=True
)
@option("-o --output OUT.bml", "File to write.  [default: print it]", options.OUTPUT)
def enrich(
    text: str, language: str | None, words: Path | None, plain: bool, output: Path | None, **who: Any
) -> int:
    """Add facial expressions to a text or a BML document (Wojdel 2005, 6.5).

    A text becomes a BML document that speaks it, with expressions at words and sentence ends; in a document,
    speeches and expressions get the expressions that usually accompany them. The attribute `because` of each
    added expression names the rule that placed it.

    \b
    realizer enrich "Are you sure? That is nonsense!" -o sure.bml
    realizer realize sure.bml -o sure.mp4
    """
    from realizer.enrichment import Enrichment
    from realizer.knowledge.enrich import Enricher

    source = _read(text)
    lists = words_for(language, words)
    with inputs.reporting(ValueError):
        enricher = Enricher(who["role"], who["mood"], lists, *rules_for(who["knowledge"]))
        enriched = Enrichment.of(source, enricher, partial(click.echo, err=True), plain=plain)
    if not is_quiet():
        warn_unknown_languages(lists, enriched.languages, set())
    if language is None and words is None and _is_foreign(source, lists.language):
        note(
            f"this text has no letters of {lists.language!r}, so only punctuation counts; see --language and "
            "--words"
        )
    if output is None:
        sys.stdout.write(enriched.bml)
    else:
        with inputs.opening(output):
            output.write_text(enriched.bml, "utf-8")
        placed = enriched.placed
        note(f"{output}: {placed} expression{'s' * (placed != 1)} placed")
    return 1 if enriched.faults else 0


def _is_foreign(text: str | bytes, language: str) -> bool:
    """Return whether a text that is taken for English has letters, but no English ones."""
    if isinstance(text, bytes) or language.partition("-")[0].lower() != "en":
        return False
    letters = [letter for letter in text if letter.isalpha()]
    return bool(letters) and not any(letter.isascii() for letter in letters)


def _read(text: str) -> str | bytes:
    """Return the text, or the content of the file or standard input; XML names its encoding: bytes."""
    from realizer.enrichment import MARKED
    from realizer.sources import is_file_name

    if text != "-" and not is_file_name(text):
        return text
    data = inputs.read_file(text)
    return data if MARKED.match(data) else inputs.decode(data, text, "a text")
