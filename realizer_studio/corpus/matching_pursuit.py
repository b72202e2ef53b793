"""Faces explained by a few shapes: matching pursuit with non-negative least squares."""

import numpy as np

from realizer.core.array_types import Float64


def explain(faces: Float64, shapes: Float64, most: int, worth: float) -> tuple[list[int], Float64]:
    """Return the rows of shapes (m, d) that explain faces (n, d), and their weights (n, chosen rows).

    Rows are chosen one after the other, each the one that explains most of what is left.

    Args:
        most: rows.
        worth: the least share of all squared movement that one more row explains.
    """
    from scipy.optimize import nnls

    whole = float(np.sum(faces**2))
    lengths = np.maximum(np.linalg.norm(shapes, axis=1), 1e-9)
    chosen: list[int] = []
    weights = np.zeros((len(faces), 0))
    while len(chosen) < most:
        rest = faces - weights @ shapes[chosen]
        gains = np.sum(np.maximum(rest @ (shapes / lengths[:, None]).T, 0) ** 2, axis=0)
        gains[chosen] = 0
        if gains.max() <= worth * whole:
            break
        chosen.append(int(gains.argmax()))
        weights = np.stack([nnls(shapes[chosen].T, face)[0] for face in faces])
    return chosen, weights
