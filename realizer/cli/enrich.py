"""`enrich`: a text or documents in, BML with the expressions of the knowledge base out."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from realizer.cli import options

if TYPE_CHECKING:
    from bml_schema import Block
    from realizer.knowledge.enrich import Enricher

__all__: list[str] = []


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


@click.command()
@click.argument("text", metavar="TEXT|FILE|-")
@role
@mood
@click.option("--language", default="en", show_default=True, metavar="BCP-47", help="Of the text.")
@click.option(
    "--words",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="FILE.csv",
    help="Emotional words of your own, or of another language: word, category, origin.",
)
@click.option(
    "-o", "--output", metavar="OUT.bml", type=click.Path(path_type=Path), help="Default: standard output."
)
def enrich(text: str, role: Any, mood: Any, language: str, words: Path | None, output: Path | None) -> int:
    """Give a text the face of who says it: BML with expressions at its words (Wojdel 2005, 6.5).

    TEXT is what is said, a file of it, or a BML document, whose speeches and expressions get what goes with
    them. Each expression says in `because` which rule placed it. The expressions are her templates.

    \b
    realizer enrich "Are you sure? That is nonsense!" -o sure.bml
    realizer realize sure.bml -o sure.mp4
    """
    from bml_schema import write
    from realizer.knowledge.enrich import Enricher
    from realizer.tables.emotional_words import word_list, words_of

    said = _read(text)
    if not said.strip():
        raise click.UsageError("wanted a text or a BML document, got nothing but blanks")
    own = words_of(words) if words is not None else None
    if own is None and word_list(language) is None:
        click.echo(
            f"no emotional words for language {language!r}: only punctuation counts; see --words", err=True
        )
    enricher = Enricher(role, mood, language, own)
    faults = 0
    if said.lstrip("\ufeff \t\r\n").startswith("<"):
        blocks, faults = _documents(said, enricher)
    else:
        blocks = [enricher.text(said)]
    result = "".join(write(block) for block in blocks)
    if output is None:
        sys.stdout.write(result)
    else:
        output.write_text(result, "utf-8")
        placed = sum(bool(getattr(node, "because", "")) for block in blocks for node in block.behaviours)
        click.echo(f"{output}: {placed} expressions placed", err=True)
    return 1 if faults else 0


def _read(text: str) -> str:
    """The text itself, or what a file of that name or standard input holds."""
    try:
        is_file = text == "-" or Path(text).is_file()
    except (OSError, ValueError):  # too long for a name
        is_file = False
    if not is_file:
        return text
    return options.read_documents([text])[0].decode("utf-8", "replace")


def _documents(text: str, enricher: Enricher) -> tuple[list[Block], int]:
    """Every block of a stream of documents, enriched; a broken one is told, and left out."""
    from bml_schema import Block, Speech, read
    from realizer.behaviours import VOCABULARY
    from realizer.knowledge.sentences import sentences

    blocks: list[Block] = []
    faults = 0
    for item in read(text, VOCABULARY):
        problems = item.problems if isinstance(item, Block) else (item,)
        for problem in problems:
            click.echo(f"realizer: {problem}", err=True)
            faults += 1
        if not isinstance(item, Block):
            continue
        if enricher.role == "speaker":
            blocks.append(enricher.block(item))
            continue
        said: list[tuple[str, float]] = []
        now = 0.0
        for node in item.behaviours:
            if isinstance(node, Speech) and node.text is not None:
                said.append((str(node.text), now))
                now += max(
                    (s.words[-1].end for s in sentences(str(node.text), enricher.language)), default=0.0
                )
        blocks.append(enricher.listener(said, f"{item.id}-listener"))
    return blocks, faults
