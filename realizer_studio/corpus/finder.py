"""A finder of expressions in the frames of a corpus, by its map (Wojdel 2005, 7.3.2)."""

from collections.abc import Iterable, Sequence

import numpy as np

from realizer.core.array_types import Bool
from realizer_studio.corpus.face_map import FaceMap, distances, features
from realizer_studio.corpus.recording import Recording, Segment

FINDER = "map"  # annotator of the segments
GAP = 1  # frames; the longest gap in an expression that is filled (eq. 7.9)
SHORTEST = 5  # frames
JOINED = 12  # frames from a segment to the next up to which both are joined (eq. 7.11)


def find(recording: Recording, learnt: FaceMap) -> list[Segment]:
    """Return the segments of all expressions for which a map has neurons, in order."""
    distance = distances(learnt.project(features(recording)), learnt.neurons)
    found = []
    for name in sorted({*learnt.names} - {""}):
        neurons = [k for k, other in enumerate(learnt.names) if other == name]
        accepted = np.asarray((distance[:, neurons] <= learnt.accepted[neurons]).any(axis=1))
        found += [Segment(first, last, name, FINDER) for first, last in segments(accepted)]
    return sorted(found, key=lambda one: (one.first, one.last))


def segments(shown: Bool) -> list[tuple[int, int]]:
    """Return first and last frames of segments: gaps filled, short segments dropped, near ones joined."""
    filled = _join(runs(shown), GAP + 1)
    return _join([(first, last) for first, last in filled if last - first + 1 >= SHORTEST], JOINED)


def runs(shown: Bool) -> list[tuple[int, int]]:
    """Return the first and last frame of each run of true frames."""
    edges = np.flatnonzero(np.diff(np.r_[0, np.asarray(shown, np.int8), 0]))
    return [(int(first), int(end) - 1) for first, end in zip(edges[::2], edges[1::2], strict=True)]


def _join(runs: Iterable[tuple[int, int]], most: int) -> list[tuple[int, int]]:
    """Join runs that begin at most `most` frames after the end of the previous run."""
    found: list[tuple[int, int]] = []
    for first, last in runs:
        if found and first - found[-1][1] <= most:
            found[-1] = found[-1][0], last
        else:
            found.append((first, last))
    return found


def agreement(true: Sequence[Segment], found: Sequence[Segment], frames: int) -> tuple[float, float]:
    """Return the share of equal frames, and the share of true segments that are found (7.4)."""
    names = sorted({one.text for one in (*true, *found)})
    visible = np.zeros((2, len(names), frames), bool)
    for side, some in zip(visible, (true, found), strict=True):
        for one in some:
            side[names.index(one.text), one.first : one.last + 1] = True
    same = int((visible[0] == visible[1]).all(axis=0).sum())
    met = sum(any(o.text == t.text and o.gap(t) < 0 for o in found) for t in true)
    return same / max(frames, 1), met / max(len(true), 1)
