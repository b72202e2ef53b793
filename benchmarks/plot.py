"""Shows growth as text: bars, and the exponent of a power law."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

__all__ = ["bars", "exponent"]

WIDTH = 50


def exponent(sizes: Sequence[float], values: Sequence[float]) -> float:
    """Return b of the best fit values = a x sizes ** b; 1 means linear growth."""
    slope, _ = np.polyfit(np.log(sizes), np.log(np.maximum(values, 1e-9)), 1)
    return float(slope)


def bars(sizes: Sequence[float], values: Sequence[float]) -> str:
    """Return a line for each size, with the size, a bar and the value."""
    largest = max(values) or 1.0
    rows = zip(sizes, values, strict=True)
    return "\n".join(f"{size:8g} {'#' * round(WIDTH * v / largest):{WIDTH}} {v:.3g}" for size, v in rows)
