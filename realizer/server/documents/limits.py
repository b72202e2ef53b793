"""The limits on messages, blocks, schedules, pictures and memory. Each check returns an error text or None.

Their numbers are the settings `max_NAME` (`realizer/core/settings.py`).
"""

import os
import sys
from collections.abc import Collection
from pathlib import Path

from bml_schema import Block, Speech
from realizer.core.settings import Settings, limit_hint
from realizer.playback.references import external_refs
from realizer.scheduling.timing import Schedule

MEMORY = Path("/proc/self/statm")  # the second number: resident pages

# The wire has one byte for the index of a character, and part of its range is for views.
MAX_CHARACTERS = 16


def size_error(text: str, settings: Settings) -> str | None:
    """Return why the documents of a message are refused, or None."""
    size = len(text) if text.isascii() else len(text.encode("utf-8", "surrogatepass"))
    if size > settings.max_document:
        words = f"wanted at most {settings.max_document} bytes of BML in a message, got {size}"
        return f"{words} {limit_hint('max_document')}"
    # Comments are counted as elements too; a document has few of them.
    count = text.count("<") - text.count("</")
    if count > settings.max_elements:
        words = f"wanted at most {settings.max_elements} elements in a message, got {count}"
        return f"{words} {limit_hint('max_elements')}"
    return None


def block_limit_error(
    block: Block, settings: Settings, busy: int, characters: Collection[str | None]
) -> str | None:
    """Return why a session refuses a block, or None."""
    longest = _longest_speech(block)
    if longest > settings.max_speech:
        words = f"wanted at most {settings.max_speech} characters in one speech, got {longest}"
        return f"{words} {limit_hint('max_speech')}"
    if busy >= settings.max_blocks:
        words = f"{settings.max_blocks} blocks play or wait: wanted fewer at a time"
        return f"{words} {limit_hint('max_blocks')}"
    if block.character_id not in (None, *characters) and len(characters) >= MAX_CHARACTERS:
        return f"wanted at most {MAX_CHARACTERS} characters in a session"
    return None


def _longest_speech(block: Block) -> int:
    speeches = [node for node in block.behaviours if isinstance(node, Speech)]
    texts = [sum(len(part) for part in s.text.parts if isinstance(part, str)) for s in speeches if s.text]
    return max([0, *texts, *(len(form.content) for s in speeches for form in s.descriptions)])


def duration_error(block: Block, schedule: Schedule, settings: Settings) -> str | None:
    """Return why a planned block is too long, or None.

    A block that refers to points of other blocks or of anticipators has no limit: for example, an open speech
    has no end yet.
    """
    if schedule.duration <= settings.max_duration or external_refs(block):
        return None
    text = f"wanted a block of at most {settings.max_duration:g} s, got {schedule.duration:.1f}"
    return f"{text} {limit_hint('max_duration')}"


def pixel_rate_error(
    size: tuple[int, int], fps: float, settings: Settings, others: float = 0.0
) -> str | None:
    """Return why pictures of this size are not drawn at this rate, or None.

    Args:
        others: pixels a second of the session's other pictures; a shared picture counts once.
    """
    pixels = size[0] * size[1] * fps
    if pixels + others <= settings.max_pixels:
        return None
    text = f"wanted at most {settings.max_pixels:g} pixels a second of a session's pictures, got {pixels:g}"
    more = f" beside {others:g} of others" if others else ""
    return f"{text}, {size[0]}x{size[1]} at {fps:g} fps{more} {limit_hint('max_pixels')}"


def memory_error(settings: Settings) -> str | None:
    """Return why there is no memory for another session, or None."""
    if settings.max_memory is None or (used := memory() / 1e6) <= settings.max_memory:
        return None
    return f"the service uses {used:.0f} MB: wanted at most {settings.max_memory} {limit_hint('max_memory')}"


def memory() -> int:
    """Return the resident bytes of this process; their maximum so far, or 0, on systems without /proc."""
    try:
        return int(MEMORY.read_text("ascii").split()[1]) * os.sysconf("SC_PAGE_SIZE")
    except (OSError, ValueError, IndexError):
        pass
    try:
        import resource
    except ImportError:  # Windows
        return 0
    maximum = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return maximum if sys.platform == "darwin" else maximum * 1024
