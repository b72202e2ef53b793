"""Expressions found in the frames of a corpus by its map (Wojdel 2005, 7.3.2)."""

from collections.abc import Iterable, Sequence

import numpy as np

from realizer.core.array_types import Bool
from realizer_studio.corpus.learn import FaceMap, distances, features
from realizer_studio.corpus.recording import Recording, Segment

FINDER = "map"  # annotator of what is found
GAP = 1  # frames that are filled between two frames of an expression (eq. 7.9)
SHORTEST = 5  # frames
JOINED = 12  # frames from the last of a segment to the first of the next, which are joined (eq. 7.11)


def find(recording: Recording, learnt: FaceMap) -> list[Segment]:
    """Return the segments of all expressions that a map has neurons of, in order."""
    away = distances(learnt.places(features(recording)), learnt.neurons)
    found = []
    for name in sorted({*learnt.names} - {""}):
        mine = [k for k, other in enumerate(learnt.names) if other == name]
        accepted = np.asarray((away[:, mine] <= learnt.accepted[mine]).any(axis=1))
        found += [Segment(first, last, name, FINDER) for first, last in segments(accepted)]
    return sorted(found, key=lambda one: (one.first, one.last))


def segments(shown: Bool) -> list[tuple[int, int]]:
    """Return the first and last frames of segments: gaps filled, short ones left out, near ones joined."""
    filled = _joined(runs(shown), GAP + 1)
    return _joined([(first, last) for first, last in filled if last - first + 1 >= SHORTEST], JOINED)


def runs(shown: Bool) -> list[tuple[int, int]]:
    """Return the first and last frames of each run of frames that show something."""
    edges = np.flatnonzero(np.diff(np.r_[0, np.asarray(shown, np.int8), 0]))
    return [(int(first), int(end) - 1) for first, end in zip(edges[::2], edges[1::2], strict=True)]


def _joined(runs: Iterable[tuple[int, int]], most: int) -> list[tuple[int, int]]:
    """Join runs whose first frame is at most `most` after the last frame of the one before."""
    found: list[tuple[int, int]] = []
    for first, last in runs:
        if found and first - found[-1][1] <= most:
            found[-1] = found[-1][0], last
        else:
            found.append((first, last))
    return found


def agreement(true: Sequence[Segment], found: Sequence[Segment], frames: int) -> tuple[float, float]:
    """Return the shares of frames that show the same, and of true segments that are found (7.4)."""
    names = sorted({one.text for one in (*true, *found)})
    shown = np.zeros((2, len(names), frames), bool)
    for side, some in zip(shown, (true, found), strict=True):
        for one in some:
            side[names.index(one.text), one.first : one.last + 1] = True
    same = int((shown[0] == shown[1]).all(axis=0).sum())
    met = sum(any(o.text == t.text and o.gap(t) < 0 for o in found) for t in true)
    return same / max(frames, 1), met / max(len(true), 1)
