"""Checking of sources: `realizer.check`."""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import replace
from itertools import islice
from pathlib import Path

from bml_schema.source import Source as SourceText
from realizer.behaviours.kind import Position
from realizer.checking.advice import advice as advice_on
from realizer.checking.document import check_document
from realizer.checking.finding import Finding
from realizer.core.options import PlayOptions
from realizer.playback.player import Player
from realizer.sources import Source, documents_of, folder_of

MAX_ADVICE = 20  # per block: one mistake is often repeated all over a document


def check(
    source: Source | Iterable[Source],
    *,
    scene: Mapping[str, Position] | None = None,
    media: Path | None = None,
    expressions: Path | None = None,
    strict_bml: bool = False,
    advice: bool = False,
) -> list[Finding]:
    """Return every fault of documents, in order; each has line, column, type, text and help.

    Args:
        source: BML, a text, a file, or a list of these, as in `realizer.realize`. Documents are checked
            separately.
        scene, media, expressions, strict_bml: as in `realizer.realize`.
        advice: whether to add advice about likely mistakes, of the type "ADVICE".

    Raises:
        FileNotFoundError: there is no such file.
        TypeError: the source or an option has another type.
    """
    if not isinstance(advice, bool):
        raise TypeError(f"advice: wanted True or False, got {advice!r}")
    options = PlayOptions(scene=scene, media=media, expressions=expressions, strict_bml=strict_bml)
    found: list[Finding] = []
    for number, document in enumerate(documents_of(source), 1):
        own = replace(options, media=options.media or folder_of([document.file]))
        player, name = Player(own, animates=False), document.file or f"document {number}"
        found += findings_of(name, document.bml, player, MAX_ADVICE if advice else 0)
    return found


def findings_of(name: str, text: bytes | str, player: Player, most_advice: int) -> Iterator[Finding]:
    """Yield the faults of a document, and after those of each block at most so much advice on it."""
    source = SourceText(text)
    for part in check_document(name, source, text, player):
        yield from part.findings
        if part.block is not None and part.schedule is not None:
            yield from islice(advice_on(name, source, part.block, part.schedule, player), most_advice)
