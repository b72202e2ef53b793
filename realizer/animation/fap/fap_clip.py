"""FAP clips: integer MPEG-4 FAP frames at a rate of their own, as in a FAP file."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np

from realizer.animation.frames import FAPFrames
from realizer.core.array_types import Bool, Int32
from realizer.core.units import frame_count


@dataclass(frozen=True, eq=False)
class FAPClip:
    """The contents of a text FAP file."""

    name: str  # from the header; without blanks when written
    fps: float  # frames a second
    # (n, 68) int32 in each FAP's FAPU, column = FAP - 1; 0 where a frame does not specify the FAP. Columns 0
    # and 1 are 0.
    values: Int32
    mask: Bool  # (68,) bool, True where any frame specifies the FAP
    visemes: Int32  # (n, 4) int32: select1, select2, blend, def of FAP 1; zeros unless mask[0]
    expressions: Int32  # (n, 6) int32: select1, intensity1, select2, intensity2, init_face, def of FAP 2
    notes: tuple[str, ...] = field(default=())  # deviations of the text from the format, a sentence each

    @staticmethod
    def of(frames: FAPFrames, fps: float, name: str) -> FAPClip:
        """Return a clip of frames, rounded to integers, without FAP 1 and 2."""
        values = frames.integers()
        mask = frames.mask.copy()
        mask[:2] = False
        values[:, ~mask] = 0
        count = len(values)
        return FAPClip(
            name, fps, values, mask, np.zeros((count, 4), np.int32), np.zeros((count, 6), np.int32)
        )

    def from_frame(self, frame: int) -> FAPClip:
        parts = (self.values[frame:], self.mask, self.visemes[frame:], self.expressions[frame:])
        return FAPClip(self.name, self.fps, *parts, self.notes)

    def resampled(self, fps: float) -> FAPClip:
        """Return the clip at another rate: FAPs by linear interpolation, FAP 1 and 2 of the nearest frame.

        Raises:
            ValueError: if the rate is not positive and finite.
        """
        if not (math.isfinite(fps) and fps > 0):
            raise ValueError(f"fps: wanted a number above 0, got {fps}")
        if fps == self.fps or not len(self.values):
            return replace(self, fps=fps)
        last = len(self.values) - 1
        count = frame_count(last / self.fps, fps)
        at = np.minimum(np.arange(count) * (self.fps / fps), last)
        before = np.minimum(at.astype(int), max(last - 1, 0))
        part = (at - before)[:, None]
        values = self.values[before] * (1 - part) + self.values[np.minimum(before + 1, last)] * part
        nearest = np.rint(at).astype(int)
        return replace(
            self,
            fps=fps,
            values=np.rint(values).astype(np.int32),
            visemes=self.visemes[nearest],
            expressions=self.expressions[nearest],
        )

    def frames(self) -> FAPFrames:
        """Return the values on a clock that starts at 0, without FAP 1 and 2, which frames do not hold."""
        mask = self.mask.copy()
        mask[:2] = False
        return FAPFrames(np.arange(len(self.values)) / self.fps, self.values.astype(np.float32), mask)

    def __eq__(self, other: object) -> bool:
        """Compare name, rate and numbers, but not notes."""
        if not isinstance(other, FAPClip):
            return NotImplemented
        arrays = ("values", "mask", "visemes", "expressions")
        return (self.name, self.fps) == (other.name, other.fps) and all(
            np.array_equal(getattr(self, a), getattr(other, a)) for a in arrays
        )

    __hash__ = None  # type: ignore[assignment]
