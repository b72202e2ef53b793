"""A film of a person, played again by another head.

  python examples/track_and_replay.py talk.mp4 ben again.mp4

It needs the extra `track`. No picture leaves the machine.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

import realizer


def main(film: str, face: str, again: str) -> None:
    with tempfile.TemporaryDirectory() as folder:
        document = Path(folder) / "film.bml"
        subprocess.run([sys.executable, "-m", "realizer", "track", film, "-o", document], check=True)
        played = realizer.realize(document, face=face, idle=False)  # only what was seen
        print(played)
        print(played.save(again))


if __name__ == "__main__":
    if len(sys.argv) <= 3:
        sys.exit(__doc__)
    main(*sys.argv[1:4])
