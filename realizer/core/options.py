"""Options of playing documents, the same for `realize`, the commands, the service and batches."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class PlayOptions:
    """How documents are played, and what face they move.

    Attributes:
        face: name of a face folder.
        deformer: what moves it: "mpeg4" (FAPs) or "au" (its model of action units); None is what it says.
        fps: frames a second.
        scene: target name -> (x, y, z) metres, origin between the eyes; None while no scene was declared.
        seed: for idle motion and anything else random; the same seed gives the same frames.
        idle: blinks and small head motion between and under the behaviours.
        language: BCP-47 of speech that does not name its own.
        media: the folder of the files that documents may name; None: they may name none.
        expressions: a folder of the user's own expressions, before those that ship; None: there are none.
        cooccurrence: which AUs a face can show together: "on" (the rules that ship), "off", or a file.
        prosody: nods, brows, blinks and looks that go with what is said; none without `idle`.
        mapping: a file of what AUs ask of FAPs; it goes before what the face says.

    Raises:
        ValueError: `fps` is not a number above 0.
    """

    face: str = "default"
    deformer: str | None = None
    fps: float = 25.0
    scene: Mapping[str, tuple[float, float, float]] | None = None
    seed: int = 0
    idle: bool = True
    language: str = "en-US"
    media: Path | None = None
    expressions: Path | None = None
    cooccurrence: str = "on"
    prosody: bool = True
    mapping: Path | None = None

    def __post_init__(self) -> None:
        if not (math.isfinite(self.fps) and self.fps > 0):
            raise ValueError(f"fps: wanted a number above 0, got {self.fps}")


DEFAULTS = PlayOptions()
