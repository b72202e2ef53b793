"""An .npz file of a face folder in, its checked arrays out."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from realizer.errors import FaceError

__all__: list[str] = []


def read_arrays(path: Path, wanted: dict[str, int]) -> dict[str, Any]:
    """The arrays of an .npz file.

    Args:
        wanted: name -> number of dimensions.

    Raises:
        FaceError: no such file, a missing array, or one of another shape.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except FileNotFoundError:
        raise FaceError(f"{path}: wanted this file, found none; build the face again") from None
    except (OSError, ValueError) as error:
        raise FaceError(f"{path}: {error}; build the face again") from None
    for name, dimensions in wanted.items():
        if name not in arrays:
            raise FaceError(f"{path}: wanted an array {name!r}, found {', '.join(sorted(arrays))}")
        if arrays[name].ndim != dimensions:
            raise FaceError(f"{path}: {name}: wanted {dimensions} dimensions, got {arrays[name].shape}")
    return arrays
