"""What the archetypes' faces show in; realizer/tables/profiles_own.csv out.

`python -m tests.own_profiles` writes the file. An archetype is drawn once, as action units (emotions.toml);
its profile is what these ask of the FAPs, and a little room around it.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from realizer import tables
from realizer.animation.axis import AU_NAMES, au, axis
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames
from realizer.tables.cooccurrence import rules
from realizer.tables.emotions import emotion_faces

__all__ = ["FILE", "render"]

FILE = Path(tables.__file__).with_name("profiles_own.csv")
LEAST = 10.0  # FAPU; what asks less is left out
ROOM, LEAST_ROOM = 0.15, 8.0  # either side: a part of the value, but at least so many FAPU
HEAD = """\
# source: own: what the faces of emotions.toml ask of the FAPs by au_to_fap.csv, and 15 % either side
# made by `python -m tests.own_profiles`
# units: each FAP's own FAPU; as an emotion shows at activation 7, the rim of the wheel
# licence: written for this project, MIT
emotion,profile,fap,low,high
"""


def render() -> str:
    """The whole file."""
    return HEAD + "".join(f"{line}\n" for line in _rows())


def _rows() -> Iterator[str]:
    faces = emotion_faces()
    values = np.zeros((len(faces), len(axis())), np.float32)
    for row, face in zip(values, faces.values(), strict=True):
        for (number, side), value in face.aus.items():
            row[[target.column for target in au(number, side)]] = value
    assert not values[:, len(AU_NAMES()) :].any()
    asked = to_fap(AUFrames(np.arange(len(faces), dtype=np.float64), values, rules())).values
    for name, row in zip(faces, asked, strict=True):
        for fap, value in enumerate(row.tolist(), 1):
            if abs(value) >= LEAST:
                room = max(ROOM * abs(value), LEAST_ROOM)
                yield f"{name},0,{fap},{value - room:.0f},{value + room:.0f}"


if __name__ == "__main__":
    FILE.write_text(render(), "utf-8")
