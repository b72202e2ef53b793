"""What a voice does with SSML: what it does not support is replaced, or left out with a warning."""

from collections.abc import Collection, Iterator
from dataclasses import replace

from realizer.speech.ssml import STRENGTHS, Break, Part, Script, Tag, collapsed
from realizer.speech.ssml_prosody import EMPHASIS

ENDS = ".!?…:;。！？"  # of sentences and clauses
REPLACED = frozenset({"emphasis", "p", "s", "say-as"})
PARAGRAPH = STRENGTHS["medium"]  # s of silence after one


def supported(script: Script, elements: frozenset[str], voice: str) -> Script:
    """Return a script for a voice that supports these elements of `ssml.SPOKEN`, with warnings.

    Emphasis becomes prosody, characters are written with spaces between them, a paragraph or a sentence ends
    with a full stop if it has no other sign. Of others the text is spoken as usual, with one warning for each
    kind.
    """
    parts = list(_replaced(script.parts, elements))
    known = REPLACED | elements
    unknown = {part.name: None for part in script.parts if isinstance(part, Tag) and part.name not in known}
    warnings = [f"{voice} does not support <{name}>: its text is spoken as usual" for name in unknown]
    return replace(script, parts=tuple(collapsed(parts)), warnings=(*script.warnings, *warnings))


def _replaced(parts: Collection[Part], elements: frozenset[str]) -> Iterator[Part]:
    text = ""  # since the last end of a sentence
    speaks = False  # since the last end of a paragraph
    spells = False
    for part in parts:
        if isinstance(part, str):
            part = " ".join(part.upper()) if spells else part
            text = part.rstrip() or text
            speaks |= bool(text)
        if not isinstance(part, Tag) or part.name in elements:
            yield part
        elif part.name == "emphasis":
            level = None if part.attributes is None else dict(part.attributes).get("level", "moderate")
            yield Tag("prosody", None if level is None else EMPHASIS.get(level, EMPHASIS["moderate"]))
        elif part.name == "say-as":
            spells = part.attributes is not None
        elif part.name in ("p", "s") and part.attributes is None:
            if text and text[-1] not in ENDS:
                yield "."
            if part.name == "p" and speaks:
                yield Break(PARAGRAPH)
                speaks = False
            text = ""
