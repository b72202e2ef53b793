"""Checked readers of the files in face folders."""

import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from tokenize import TokenError
from typing import Any

import numpy as np

from realizer.core.errors import FaceError, TableError

LARGEST = 2**28  # bytes of the arrays of a file; those of a shipped face have 330 kB


@contextmanager
def face_errors(path: Path, wanted: str) -> Iterator[None]:
    """Turn what reading a text, CSV or TOML file raises into a FaceError; `wanted` says what it should be."""
    try:
        yield
    except FileNotFoundError:
        raise FaceError(f"{path}: wanted {wanted}, found none") from None
    except OSError as error:
        raise FaceError(f"{path}: wanted {wanted}, got {error.strerror}") from None
    except UnicodeDecodeError:
        raise FaceError(f"{path}: wanted {wanted}, got bytes that are no UTF-8") from None
    except ValueError as error:
        raise FaceError(f"{path}: wanted {wanted}, got: {error}") from None
    except TableError as error:
        raise FaceError(str(error)) from None


def read_arrays(path: Path, wanted: dict[str, int]) -> dict[str, Any]:
    """Read the arrays of an .npz file.

    Args:
        wanted: name -> number of dimensions.

    Raises:
        FaceError: no such file, one that is damaged or no .npz, a missing array, or one of another shape.
    """
    again = "copy or build the face again"
    try:
        # Opened by zipfile, because numpy reads a file that is no archive as a pickle or a single array.
        with zipfile.ZipFile(path) as archive:
            if (size := sum(member.file_size for member in archive.infolist())) > LARGEST:
                raise FaceError(f"{path}: wanted at most {LARGEST} bytes of arrays, got {size}; {again}")
            broken = archive.testzip()
        if broken:
            raise FaceError(f"{path}: {broken} is damaged; {again}")
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
    except FileNotFoundError:
        raise FaceError(f"{path}: wanted this file, found none; build the face again") from None
    except OSError as error:
        raise FaceError(f"{path}: wanted an .npz file, got {error.strerror or error}; {again}") from None
    except (zipfile.BadZipFile, EOFError, zlib.error, NotImplementedError):
        raise FaceError(
            f"{path}: wanted an .npz file, got one that is cut short or no archive; {again}"
        ) from None
    except (ValueError, TokenError, MemoryError):  # also of a header that claims too much
        raise FaceError(f"{path}: wanted arrays of numbers, got something else; {again}") from None
    for name, dimensions in wanted.items():
        if name not in arrays:
            raise FaceError(f"{path}: wanted an array {name!r}, found {', '.join(sorted(arrays))}")
        if arrays[name].ndim != dimensions:
            raise FaceError(f"{path}: {name}: wanted {dimensions} dimensions, got {arrays[name].shape}")
        if arrays[name].dtype.kind not in "biuf":
            raise FaceError(f"{path}: {name}: wanted numbers, got {arrays[name].dtype}; {again}")
    return arrays
