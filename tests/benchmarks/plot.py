"""How something grows, as text: bars, and the power of its growth."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

__all__ = ["bars", "exponent"]

WIDTH = 50


def exponent(sizes: Sequence[float], values: Sequence[float]) -> float:
    """b of the best values = a x sizes ** b: 1 where it grows linearly."""
    slope, _ = np.polyfit(np.log(sizes), np.log(np.maximum(values, 1e-9)), 1)
    return float(slope)


def bars(sizes: Sequence[float], values: Sequence[float]) -> str:
    """A line for each size: the size, a bar and the value."""
    most = max(values) or 1.0
    rows = zip(sizes, values, strict=True)
    return "\n".join(f"{size:8g} {'#' * round(WIDTH * v / most):{WIDTH}} {v:.3g}" for size, v in rows)
