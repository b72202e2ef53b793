"""FAP frames as MPEG-4 text (.fap, version 2.1), as Xface and Greta read it; `fap_reader` reads it back."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from realizer.animation.frames import FAPFrames
from realizer.arrays import Bool, Int32
from realizer.outputs.files import write_text
from realizer.outputs.output import Drawing, Output

if TYPE_CHECKING:
    from realizer.pipeline import Realization

__all__ = ["OUTPUTS", "FAPClip", "encode", "write_fap"]


@dataclass(frozen=True, eq=False)
class FAPClip:
    """A text FAP file as numbers.

    Attributes:
        name: from the header; no blanks when written.
        fps: frames a second.
        values: (n, 68) int32 in each FAP's FAPU, column = FAP - 1; 0 where not given. Columns 0 and 1 are 0.
        mask: (68,) bool, True where any frame gives the FAP.
        visemes: (n, 4) int32: select1, select2, blend, def of FAP 1; zeros unless mask[0].
        expressions: (n, 6) int32: select1, intensity1, select2, intensity2, init_face, def of FAP 2.
        notes: how the text departed from the format, a sentence each; () for what `encode` wrote.
    """

    name: str
    fps: float
    values: Int32
    mask: Bool
    visemes: Int32
    expressions: Int32
    notes: tuple[str, ...] = field(default=())

    @staticmethod
    def of(frames: FAPFrames, fps: float, name: str) -> FAPClip:
        """The frames rounded to integers; FAP 1 and 2 stay out."""
        values = frames.integers()
        mask = frames.mask.copy()
        mask[:2] = False
        values[:, ~mask] = 0
        count = len(values)
        return FAPClip(
            name, fps, values, mask, np.zeros((count, 4), np.int32), np.zeros((count, 6), np.int32)
        )

    def frames(self) -> FAPFrames:
        """The values on a clock that starts at 0; FAP 1 and 2 are left out: frames have no place for them."""
        mask = self.mask.copy()
        mask[:2] = False
        return FAPFrames(np.arange(len(self.values)) / self.fps, self.values.astype(np.float32), mask)

    def __eq__(self, other: object) -> bool:
        """Same name, rate and numbers; notes do not count."""
        if not isinstance(other, FAPClip):
            return NotImplemented
        arrays = ("values", "mask", "visemes", "expressions")
        return (self.name, self.fps) == (other.name, other.fps) and all(
            np.array_equal(getattr(self, a), getattr(other, a)) for a in arrays
        )

    __hash__ = None  # type: ignore[assignment]


def encode(clip: FAPClip) -> str:
    """The text. The header is the first line, the mask is the same in every frame, frames count from 0.

    Readers take a FAP without a mask bit as neutral, so what any frame uses is written in all of them.

    Raises:
        ValueError: fps is not a positive number.
    """
    if not (math.isfinite(clip.fps) and clip.fps > 0):
        raise ValueError(f"fps: wanted a positive number, got {clip.fps}")
    fps = int(clip.fps) if clip.fps == int(clip.fps) else clip.fps
    lines = [f"2.1 {_word(clip.name)} {fps} {len(clip.values)}"]
    mask = " ".join("1" if bit else "0" for bit in clip.mask)
    columns = [clip.values[:, 2:][:, clip.mask[2:]]]
    if clip.mask[1]:
        columns.insert(0, clip.expressions)
    if clip.mask[0]:
        columns.insert(0, clip.visemes)
    for k, row in enumerate(np.hstack(columns).tolist()):
        lines.append(mask)
        lines.append(" ".join(map(str, [k, *row])))
    return "\n".join(lines) + "\n"


def write_fap(realization: Realization, path: Path, drawing: Drawing) -> None:
    """The first character's frames. The name in the header is the first block's id, never the path's."""
    blocks = [schedule.block for schedule in realization.schedules]
    name = blocks[0] if blocks else "realizer"
    write_text(path, encode(FAPClip.of(realization.faps, realization.fps, name)))


def _word(name: str) -> str:
    """The name without blanks and never a number of its own: readers cut the header at blanks."""
    return re.sub(r"\s+", "_", name.strip()) or "realizer"


OUTPUTS = (Output(".fap", "text/x-fap", "MPEG-4 FAP text 2.1, integers in FAPU", write_fap),)
