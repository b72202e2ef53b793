"""Measures the steps of the pipeline: `python benchmarks/pipeline.py` prints medians and the noise.

parse + schedule   a block of 20 cross-linked behaviours
expand to FAP      10 s of frames of that block: blending, and conversion to FAPs
deform             the frames to vertices of the default face
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from stopwatch import handle_help, measure, noise

from bml_schema import parse
from realizer.animation.fap.conversion import to_fap
from realizer.behaviours.registry import VOCABULARY
from realizer.core.options import PlayOptions
from realizer.face.deform import deform
from realizer.face.load import load_face
from realizer.playback.player import Player


def block_of(count: int) -> str:
    """Return a block of nods, expressions and gazes that are linked in a chain with branches."""
    parts = ['<faceLexeme id="b0" lexeme="SMILE"/>']
    for i in range(1, count):
        before = f"b{i - 1 if i % 3 else max(0, i - 3)}"
        sync = "end" if (i - 1) % 3 == 1 else "relax"
        parts.append(
            (
                f'<faceLexeme id="b{i}" lexeme="RAISE_BROWS" start="{before}:{sync}"/>',
                f'<head id="b{i}" lexeme="NOD" stroke="{before}:relax+0.1"/>',
                f'<gaze id="b{i}" target="x" offsetAngle="10" start="{before}:relax-0.2"/>',
            )[i % 3]
        )
    return f'<bml id="b">{"".join(parts)}</bml>'


def main() -> None:
    handle_help(__doc__)
    print(noise())
    text = block_of(20)
    block = parse(text, VOCABULARY)
    print(f"{'work':<44}{'median ms':>10}{'min':>9}{'max':>9}")

    def row(name: str, work: Callable[[], object], per: int = 1) -> float:
        median, least, most = (v / per for v in measure(work))
        print(f"{name:<44}{median:>10.3f}{least:>9.3f}{most:>9.3f}")
        return median

    row("parse, 20 behaviours", lambda: parse(text, VOCABULARY))
    row("plan (timing, schedule, expand), 20", lambda: Player(PlayOptions(idle=False)).submit(block, 0.0))
    player = Player()
    player.submit(block, 0.0)
    times = np.arange(250) / 25
    cost = row("10 s of frames to FAP, a frame", lambda: to_fap(player.frames(times)), per=250)
    print(f"{'  = frames a second':<44}{1e3 / cost:>10.0f}")
    faps = to_fap(player.frames(times)).values
    face = load_face()
    row(f"deform 250 frames, {len(face.vertices)} vertices, a frame", lambda: deform(face, faps), per=250)
    row("deform a single frame", lambda: deform(face, faps[:1]))


if __name__ == "__main__":
    main()
