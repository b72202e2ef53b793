"""Conversion of a FAP clip to a BML document with one <facekeyframe>."""

from __future__ import annotations

import numpy as np

from bml_schema import Block, FaceInterpolator, FaceKeyframe, Required, write
from realizer import tables
from realizer.animation.fap.fap_clip import FAPClip
from realizer.core.errors import RealizerError


def document_of(clip: FAPClip, block: str) -> str:
    """Return BML text with the clip as keys, a line each; FAPs are limited to the range of the standard.

    FAPs that the clip defines are held, also at 0. FAP 1 and 2 are left out.

    Args:
        clip: at least two frames, and at least one FAP from 3 on.
        block: id of the block; its behaviour `fap` is required.

    Raises:
        RealizerError: the clip has nothing to play.
    """
    columns = np.flatnonzero(clip.mask[2:]) + 2
    if len(clip.values) < 2 or not len(columns):
        got = f"{len(clip.values)} frames of {len(columns)} FAPs"
        raise RealizerError(f"wanted at least two frames of a FAP from 3 on, got {got}")
    rows = [tables.faps()[column] for column in columns]
    values = np.clip(clip.values[:, columns], [r.least for r in rows], [r.most for r in rows]).astype(int)
    lines = [
        " ".join(map(str, (f"{number / clip.fps:.9g}", *row))) for number, row in enumerate(values.tolist())
    ]
    keys = "\n".join(["", *lines, ""])
    parts = " ".join(str(column + 1) for column in columns)
    node = FaceKeyframe(id="fap", type="FAPS", interpolator=FaceInterpolator(parts=parts, keys=keys))
    return write(Block(id=block, children=(Required(children=(node,)),)))
