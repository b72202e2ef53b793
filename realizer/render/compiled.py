"""Loops compiled to machine code; the only importer of numba."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

from realizer.core.errors import RenderError

NO_NUMBA = "pictures without OpenGL need the render extra: pip install 'bml-realizer[render]'"
# Without _nrt, loops count no references to arrays, which two threads would wait for; they cannot make any.
OPTIONS: Any = {
    "nogil": True,
    "_nrt": False,
    "error_model": "numpy",
    "fastmath": {"contract", "reassoc", "arcp", "nsz"},
}
Loop = TypeVar("Loop", bound=Callable[..., Any])


def compiled(loop: Loop) -> Loop:
    """Return a loop as machine code, which is cached on disk if possible.

    Raises:
        RenderError: numba is not installed; the text says what to install.
    """
    try:
        import numba
    except ImportError as error:
        raise RenderError(f"{NO_NUMBA} ({error})") from None
    try:
        fast: Any = numba.njit(cache=True, **OPTIONS)(loop)
        # Numba compiles again when the loop's own file changes; loops also call loops of other files.
        fast._cache._cache_file._source_stamp = _state_of_sources()
    except RuntimeError:  # neither our folder nor the user's can be written
        fast = numba.njit(**OPTIONS)(loop)
    typed: Loop = fast
    return typed


@cache
def _state_of_sources() -> tuple[tuple[float, int], ...]:
    """Return time and size of each file beside this one."""
    states = (path.stat() for path in sorted(Path(__file__).parent.glob("*.py")))
    return tuple((state.st_mtime, state.st_size) for state in states)
