"""Matching pursuit with non-negative least squares."""

import numpy as np

from realizer.core.array_types import Float64


def explain(faces: Float64, shapes: Float64, most: int, least_gain: float) -> tuple[list[int], Float64]:
    """Return rows of shapes (m, d) that approximate faces (n, d), and their weights (n, chosen rows).

    Rows are chosen one after the other, each the one that reduces the residual most.

    Args:
        most: the largest number of rows.
        least_gain: the least share of the squared displacement that one more row explains.
    """
    from scipy.optimize import nnls

    total = float(np.sum(faces**2))
    lengths = np.maximum(np.linalg.norm(shapes, axis=1), 1e-9)
    chosen: list[int] = []
    weights = np.zeros((len(faces), 0))
    while len(chosen) < most:
        residual = faces - weights @ shapes[chosen]
        gains = np.sum(np.maximum(residual @ (shapes / lengths[:, None]).T, 0) ** 2, axis=0)
        gains[chosen] = 0
        if gains.max() <= least_gain * total:
            break
        chosen.append(int(gains.argmax()))
        weights = np.stack([nnls(shapes[chosen].T, face)[0] for face in faces])
    return chosen, weights
