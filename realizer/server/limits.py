"""A block or a stream in, which limit of the service it is beyond, and where that is set, out."""

from __future__ import annotations

from collections.abc import Collection

from bml_schema import Block, Speech
from realizer.settings import Settings, raises

__all__ = ["MAX_CHARACTERS", "beyond", "too_many_pixels"]

# The index of a character is one byte on the wire; sixteen faces in one session are a crowd.
MAX_CHARACTERS = 16


def beyond(block: Block, settings: Settings, busy: int, characters: Collection[str | None]) -> str | None:
    """Why a session refuses a block; None where it takes it.

    Args:
        busy: how many blocks play or wait there.
        characters: those it has.
    """
    count, longest = len(block.behaviours), _longest(block)
    if count > settings.max_behaviours:
        words = f"wanted at most {settings.max_behaviours} behaviours in a block, got {count}"
        return f"{words} {raises('max_behaviours')}"
    if longest > settings.max_speech:
        words = f"wanted at most {settings.max_speech} characters in one speech, got {longest}"
        return f"{words} {raises('max_speech')}"
    if busy >= settings.max_blocks:
        words = f"{settings.max_blocks} blocks play or wait: wanted fewer at a time"
        return f"{words} {raises('max_blocks')}"
    if block.character_id not in (None, *characters) and len(characters) >= MAX_CHARACTERS:
        return f"wanted at most {MAX_CHARACTERS} characters in a session"
    return None


def too_many_pixels(size: tuple[int, int], fps: float, settings: Settings) -> str | None:
    """Why pictures of that size are not drawn at that rate; None where they are."""
    pixels = size[0] * size[1] * fps
    if pixels <= settings.max_pixels:
        return None
    words = f"wanted at most {settings.max_pixels:g} pixels a second, got {pixels:g}"
    return f"{words}, {size[0]}x{size[1]} at {fps:g} fps {raises('max_pixels')}"


def _longest(block: Block) -> int:
    """The characters of its longest speech, whichever of its forms is said."""
    longest = 0
    for node in block.behaviours:
        if isinstance(node, Speech):
            text = sum(len(part) for part in node.text.parts if isinstance(part, str)) if node.text else 0
            longest = max([longest, text, *(len(form.content) for form in node.descriptions)])
    return longest
