"""Agreement of annotators: Krippendorff's alpha for names."""

from collections.abc import Sequence

import numpy as np

from realizer.core.array_types import Float64
from realizer_studio.corpus.recording import Recording
from realizer_studio.corpus.statistics import Table


def alpha(codes: Float64, numbers: bool = False) -> float | None:
    """Return Krippendorff's alpha of codes (annotators, units); NaN: not annotated.

    1 is full agreement, 0 that of chance. None: fewer than two codes can be compared, or all are the same.
    Codes are names, or `numbers`, which differ by the square of their distance.
    """
    values = np.unique(codes[np.isfinite(codes)])
    counts = np.stack([(codes == value).sum(axis=0) for value in values]) if len(values) else np.zeros((0, 0))
    counts = counts[:, counts.sum(axis=0) > 1].astype(np.float64)
    apart = np.subtract.outer(values, values)
    differ = np.square(apart) if numbers else (apart != 0).astype(np.float64)
    per_unit, per_value = counts.sum(axis=0), counts.sum(axis=1)
    expected = per_value @ differ @ per_value
    if not expected:
        return None
    observed = ((differ @ counts * counts).sum(axis=0) / (per_unit - 1)).sum()
    return float(1 - (per_unit.sum() - 1) * observed / expected)


def agreement(recordings: Sequence[Recording]) -> Table:
    """Return the alpha of each expression, and of all, over the frames of recordings.

    An annotator without labels in a recording has not annotated it.
    """
    annotators = sorted({name for recording in recordings for name in recording.annotators})
    expressions = sorted({label.text for recording in recordings for label in recording.labels})
    parts = []
    for recording in recordings:
        codes = np.full((len(annotators), len(expressions), recording.frames), np.nan)
        for name in recording.annotators:
            mine = codes[annotators.index(name)]
            mine[:] = 0.0
            for one in recording.segments(name):
                mine[expressions.index(one.text), one.first : one.last + 1] = 1.0
        parts.append(codes)
    whole = np.concatenate(parts, axis=2)
    # What annotators see in a frame is one value: the set of its expressions.
    powers = 2.0 ** np.arange(len(expressions))
    rows = [("all", alpha(np.einsum("aef,e->af", whole, powers)))]
    rows += [(name, alpha(whole[:, k])) for k, name in enumerate(expressions)]
    title = f"Krippendorff's alpha of {', '.join(annotators)}"
    return Table("agreement", title, ("expression", "alpha"), tuple(rows))
