"""Limits of the service on texts, blocks, plans and streams."""

from __future__ import annotations

import os
import sys
from collections.abc import Collection
from pathlib import Path

from bml_schema import Block, Speech
from realizer.core.settings import Settings, raises
from realizer.playback.references import external_refs
from realizer.scheduling.timing import Schedule

MEMORY = Path("/proc/self/statm")  # its second number: pages that are in memory

# The index of a character is one byte on the wire; sixteen faces in one session are a crowd.
MAX_CHARACTERS = 16


def size_error(text: str, settings: Settings) -> str | None:
    """Why documents in one message are not read; None where they are."""
    size = len(text) if text.isascii() else len(text.encode("utf-8", "surrogatepass"))
    if size > settings.max_document:
        words = f"wanted at most {settings.max_document} bytes of BML in a message, got {size}"
        return f"{words} {raises('max_document')}"
    # Whatever else begins so is counted with them: nobody's comments are that many.
    count = text.count("<") - text.count("</")
    if count > settings.max_elements:
        words = f"wanted at most {settings.max_elements} elements in a message, got {count}"
        return f"{words} {raises('max_elements')}"
    return None


def block_limit_error(
    block: Block, settings: Settings, busy: int, characters: Collection[str | None]
) -> str | None:
    """Why a session refuses a block; None where it takes it.

    Args:
        busy: how many blocks play or wait there.
        characters: those it has.
    """
    longest = _longest(block)
    if longest > settings.max_speech:
        words = f"wanted at most {settings.max_speech} characters in one speech, got {longest}"
        return f"{words} {raises('max_speech')}"
    if busy >= settings.max_blocks:
        words = f"{settings.max_blocks} blocks play or wait: wanted fewer at a time"
        return f"{words} {raises('max_blocks')}"
    if block.character_id not in (None, *characters) and len(characters) >= MAX_CHARACTERS:
        return f"wanted at most {MAX_CHARACTERS} characters in a session"
    return None


def duration_error(block: Block, schedule: Schedule, settings: Settings) -> str | None:
    """Why what was planned is not played; None where it is.

    A block that is tied to points of others, or to what a client anticipates, lasts as these say: an open
    speech for example has no end yet.
    """
    if schedule.duration <= settings.max_duration or external_refs(block):
        return None
    words = f"wanted a block of at most {settings.max_duration:g} s, got {schedule.duration:.1f}"
    return f"{words} {raises('max_duration')}"


def pixel_rate_error(
    size: tuple[int, int], fps: float, settings: Settings, beside: float = 0.0
) -> str | None:
    """Why pictures of that size are not drawn at that rate; None where they are.

    Args:
        beside: pixels a second of the other pictures of the session; one that several look at counts once.
    """
    pixels = size[0] * size[1] * fps
    if pixels + beside <= settings.max_pixels:
        return None
    words = f"wanted at most {settings.max_pixels:g} pixels a second of a session's pictures, got {pixels:g}"
    more = f" beside {beside:g} of others" if beside else ""
    return f"{words}, {size[0]}x{size[1]} at {fps:g} fps{more} {raises('max_pixels')}"


def memory_error(settings: Settings) -> str | None:
    """Why there is no memory for one more session; None where there is."""
    if settings.max_memory is None or (used := memory() / 1e6) <= settings.max_memory:
        return None
    return f"the service uses {used:.0f} MB: wanted at most {settings.max_memory} {raises('max_memory')}"


def memory() -> int:
    """Bytes of this process in memory; the most there ever were, or 0, where the system says no more."""
    try:
        return int(MEMORY.read_text("ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, IndexError):
        pass
    try:
        import resource
    except ImportError:  # Windows
        return 0
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return most if sys.platform == "darwin" else most * 1024


def _longest(block: Block) -> int:
    """The characters of its longest speech, whichever of its forms is said."""
    longest = 0
    for node in block.behaviours:
        if isinstance(node, Speech):
            text = sum(len(part) for part in node.text.parts if isinstance(part, str)) if node.text else 0
            longest = max([longest, text, *(len(form.content) for form in node.descriptions)])
    return longest
