"""The output .fap: MPEG-4 FAP text (version 2.1), which Xface and Greta read."""

import math
import re
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np

from realizer.animation.fap.fap_clip import FAPClip
from realizer.animation.lips.viseme_weights import fap_1
from realizer.core.array_types import Int32
from realizer.outputs.output import Output, RenderSettings
from realizer.realization import Realization

SMALL = 4096  # only rotations exceed it


def encode(clip: FAPClip) -> str:
    """Return a clip as text: a header line, then a mask and values for each frame, numbered from 0.

    All frames have the mask of the clip, because readers take FAPs outside a frame's mask as neutral.

    Raises:
        ValueError: if fps is not a positive number.
    """
    if not (math.isfinite(clip.fps) and clip.fps > 0):
        raise ValueError(f"fps: wanted a positive number, got {clip.fps}")
    fps = int(clip.fps) if clip.fps == int(clip.fps) else clip.fps
    mask = "\n" + " ".join("1" if bit else "0" for bit in clip.mask) + "\n"
    frames = [" ".join([str(k), *words]) for k, words in enumerate(_words(columns(clip)))]
    return mask.join([f"2.1 {_word(clip.name)} {fps} {len(frames)}", *frames]) + "\n"


def columns(clip: FAPClip) -> Int32:
    """Return (n, k) int32: the numbers of FAP 1 and 2 if they are in the mask, then the FAPs in it."""
    compound = [
        part for part, shown in zip((clip.visemes, clip.expressions), clip.mask, strict=False) if shown
    ]
    return np.hstack([*compound, clip.values[:, 2:][:, clip.mask[2:]]])


def _words(numbers: Int32) -> list[list[str]]:
    words = _small().take(numbers + SMALL, mode="clip")
    others = (numbers < -SMALL) | (numbers > SMALL)
    words[others] = [str(number) for number in numbers[others].tolist()]
    rows: list[list[str]] = words.tolist()
    return rows


@cache
def _small() -> Any:
    """Return the texts of -SMALL..SMALL; a lookup takes a third of the time of a conversion."""
    return np.array([str(number) for number in range(-SMALL, SMALL + 1)], object)


def _encode(realization: Realization, drawing: RenderSettings) -> bytes:
    """Encode the first character's frames, named after the first block; with FAP 1 if visemes are wanted."""
    blocks = [schedule.block for schedule in realization.schedules]
    clip = FAPClip.of(realization.faps, realization.fps, blocks[0] if blocks else "realizer")
    if drawing.visemes:
        mask = clip.mask.copy()
        mask[0] = True
        clip = replace(clip, mask=mask, visemes=fap_1(realization.visemes()))
    return encode(clip).encode()


def _word(name: str) -> str:
    """Return the name without blanks, at which readers split the header."""
    return re.sub(r"\s+", "_", name.strip()) or "realizer"


FAP = Output(".fap", "text/x-fap", "MPEG-4 FAP text 2.1, integers in FAPU", _encode)
