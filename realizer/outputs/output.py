"""What an encoding is: a suffix, a media type, and a function from a realization to bytes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from realizer.pipeline import Realization

__all__ = ["Drawing", "Output"]


@dataclass(frozen=True)
class Drawing:
    """How pictures are drawn: what `realize --size --camera --at` say."""

    size: tuple[int, int] = (512, 512)  # width, height
    camera: str = "front"
    at: float | None = None  # seconds; None: the whole span


@dataclass(frozen=True)
class Output:
    """One encoding.

    Attributes:
        suffix: ".fap"; the name in `realizer outputs` is the suffix without its dot.
        media_type: such as "video/mp4".
        says: one line for `realizer outputs`.
        write: (realization, path, drawing) -> None; `path` may be any place that can be written.
        needs: the extra to install, or "" if it always works.
    """

    suffix: str
    media_type: str
    says: str
    write: Callable[[Realization, Path, Drawing], None]
    needs: str = ""
