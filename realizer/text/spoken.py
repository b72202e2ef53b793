"""`realizer.spoken_text`: what a voice is given of a text."""

from __future__ import annotations

from itertools import chain
from typing import Literal, NamedTuple

from realizer.text.parts import Part, markup, tidy
from realizer.text.stream import TextStream

SLICE = 4096  # characters that are read at a time: what is left to read is copied for each line


class PlacedBehaviour(NamedTuple):
    """A behaviour of BML, and the number of characters before it."""

    place: int
    bml: str


class SpokenText(str):
    """The words that a voice is given.

    Attributes:
        behaviours: what marks and elements in the text show, and where.
        markup: the words with SSML and behaviours, as `speech.append` takes them with `plain`.
        parts: the words, and the tags between them.
        warnings: sentences about what is left out.
    """

    parts: tuple[Part, ...] = ()
    behaviours: tuple[PlacedBehaviour, ...] = ()
    markup: str = ""
    warnings: tuple[str, ...] = ()

    @property
    def text(self) -> str:
        """The words alone."""
        return str(self)


def spoken_text(
    text: str, language: str = "en", *, emoji: bool = True, code: Literal["skip", "say"] = "skip"
) -> SpokenText:
    """Return what a voice is given of a text: its words as people say them, without markup.

    Markdown, stage directions (`*smiles*`, `[nod]`), emoji, addresses and numbers are read as people mean
    them; SSML and behaviours of BML in the text stay what they are.

    Args:
        language: BCP-47 tag, for numbers.
        emoji: whether emoji and emoticons that are known become behaviours; they are never spoken.
        code: "skip" leaves blocks of code out, "say" says "code" for each.

    Raises:
        TypeError: the text is no string.
    """
    if not isinstance(text, str):
        raise TypeError(f"text: wanted a text, got {type(text).__name__}")
    stream = TextStream(language, emoji=emoji, code=code)
    slices = [text[at : at + SLICE] for at in range(0, len(text), SLICE)]
    fed = [stream.feed(slice) for slice in slices] + [stream.feed("", close=True)]
    parts = tidy(chain.from_iterable(fed))
    words, behaviours = "", []
    for part in parts:
        if isinstance(part, str):
            words += part
        elif part.shows:
            behaviours.append(PlacedBehaviour(len(words), part.source))
    spoken = SpokenText(words)
    spoken.behaviours = tuple(behaviours)
    spoken.parts = tuple(parts)
    spoken.markup = markup(parts)
    spoken.warnings = tuple(dict.fromkeys(stream.warnings))
    return spoken
