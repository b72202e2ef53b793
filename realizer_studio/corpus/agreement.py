"""Agreement of annotators: Krippendorff's alpha for names."""

from collections.abc import Sequence

import numpy as np

from realizer.core.array_types import Float64
from realizer_studio.corpus.recording import Recording
from realizer_studio.corpus.statistics import Table


def alpha(codes: Float64, numbers: bool = False) -> float | None:
    """Return Krippendorff's alpha of codes (annotators, units), which are NaN where not annotated.

    1 is full agreement, 0 that of chance. It is None if no codes can be compared, or if all are equal.
    Codes are nominal, or, with `numbers`, differ by the square of their distance.
    """
    values = np.unique(codes[np.isfinite(codes)])
    counts = np.stack([(codes == value).sum(axis=0) for value in values]) if len(values) else np.zeros((0, 0))
    counts = counts[:, counts.sum(axis=0) > 1].astype(np.float64)
    difference = np.subtract.outer(values, values)
    differ = np.square(difference) if numbers else (difference != 0).astype(np.float64)
    per_unit, per_value = counts.sum(axis=0), counts.sum(axis=1)
    expected = per_value @ differ @ per_value
    if not expected:
        return None
    observed = ((differ @ counts * counts).sum(axis=0) / (per_unit - 1)).sum()
    return float(1 - (per_unit.sum() - 1) * observed / expected)


def agreement(recordings: Sequence[Recording]) -> Table:
    """Return the alpha of each expression, and of all together, over the frames of recordings.

    A recording counts as annotated by those who have labels in it.
    """
    annotators = sorted({name for recording in recordings for name in recording.annotators})
    expressions = sorted({label.text for recording in recordings for label in recording.labels})
    codes_by_recording = []
    for recording in recordings:
        codes = np.full((len(annotators), len(expressions), recording.frames), np.nan)
        for name in recording.annotators:
            annotator_codes = codes[annotators.index(name)]
            annotator_codes[:] = 0.0
            for one in recording.segments(name):
                annotator_codes[expressions.index(one.text), one.first : one.last + 1] = 1.0
        codes_by_recording.append(codes)
    all_codes = np.concatenate(codes_by_recording, axis=2)
    # The set of expressions in a frame is coded as one number.
    powers = 2.0 ** np.arange(len(expressions))
    rows = [("all", alpha(np.einsum("aef,e->af", all_codes, powers)))]
    rows += [(name, alpha(all_codes[:, k])) for k, name in enumerate(expressions)]
    title = f"Krippendorff's alpha of {', '.join(annotators)}"
    return Table("agreement", title, ("expression", "alpha"), tuple(rows))
