"""Options for playing documents, shared by `realize`, the commands, the service and batches."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class PlayOptions:
    """Options for playing documents.

    Attributes:
        face: name of the face.
        deformer: "mpeg4" moves the face by FAPs, "au" by its action unit model; None: the face's own choice.
        fps: frames per second.
        scene: target name -> (x, y, z) in metres, origin between the eyes; None: no scene declared.
        seed: of all random motion; the same seed gives the same frames.
        idle: whether the face blinks and its head moves slightly.
        liveliness: 0..1: how much an idle face breathes, changes its posture and moves single muscles, and
            how much its blinks vary; needs `idle`.
        language: BCP-47 tag of speech without xml:lang.
        media: folder of the files that documents may refer to; None: they may not.
        expressions: folder of a user's expressions, which override built-in ones.
        cooccurrence: rules for AUs that no face shows together: "on" (built in), "off", or a file.
        jaw, lips: how far the jaw and the lips move in speech that does not say: 0 mumbles, 1 is usual, 2
            over-articulates.
        prosody: whether nods, brows, blinks and glances accompany speech; needs `idle`.
        mapping: file that maps AUs to FAPs and overrides the face's mapping.
        grace: seconds by which a behaviour may come too late for its references into other blocks.
        max_planning: steps of planning one block; about a million take a second.
        strict_bml: whether documents are read as BML 1.0 only, without dialects.

    Raises:
        ValueError: `fps` is not a number above 0, or another number is out of its range.
    """

    face: str = "default"
    deformer: str | None = None
    fps: float = 25.0
    scene: Mapping[str, tuple[float, float, float]] | None = None
    seed: int = 0
    idle: bool = True
    liveliness: float = 1.0
    language: str = "en-US"
    media: Path | None = None
    expressions: Path | None = None
    cooccurrence: str = "on"
    prosody: bool = True
    jaw: float = 1.0
    lips: float = 1.0
    mapping: Path | None = None
    grace: float = 0.5
    max_planning: int = 2_500_000
    strict_bml: bool = False

    def __post_init__(self) -> None:
        if not (math.isfinite(self.fps) and self.fps > 0):
            raise ValueError(f"fps: wanted a number above 0, got {self.fps}")
        for name, most in (("liveliness", 1), ("jaw", 2), ("lips", 2)):
            if not 0.0 <= (value := getattr(self, name)) <= most:
                raise ValueError(f"{name}: wanted a number 0..{most}, got {value}")


DEFAULTS = PlayOptions()
