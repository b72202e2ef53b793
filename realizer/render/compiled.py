"""Loops compiled to machine code; the only importer of numba."""

import hashlib
import re
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
    "forceinline": True,
    "no_cfunc_wrapper": True,
    "error_model": "numpy",
    "fastmath": {"contract", "reassoc", "arcp", "nsz"},
}
Loop = TypeVar("Loop", bound=Callable[..., Any])


def compiled(loop: Loop) -> Loop:
    """Return a loop as machine code, which is cached on disk if possible.

    Python cannot call one whose name begins with "_"; it is compiled sooner.

    Raises:
        RenderError: numba is not installed; the text says what to install.
    """
    try:
        import numba
    except ImportError as error:
        raise RenderError(f"{NO_NUMBA} ({error})") from None
    options = {**OPTIONS, "no_cpython_wrapper": loop.__name__.startswith("_")}
    try:
        fast: Any = numba.njit(cache=True, **options)(loop)
        # Numba compiles again when the loop's own file is newer; loops also use those of other files.
        fast._cache._cache_file._source_stamp = state_of_sources()
    except RuntimeError:  # neither our folder nor the user's can be written
        fast = numba.njit(**options)(loop)
    if hasattr(fast, "_compiler"):  # not public; without it the loops are right, but slower
        fast._compiler._customize_flags = _apart
    typed: Loop = fast
    return typed


def _apart(flags: Any) -> Any:
    """Tell the compiler that no two arrays of a call overlap, which it cannot see."""
    flags.noalias = True
    return flags


@cache
def state_of_sources(folder: Path = Path(__file__).parent) -> str:
    """Return a digest of the files of a folder of ours that hold loops, and of those that they import."""
    texts = [path.read_text("utf-8") for path in sorted(folder.glob("*.py"))]
    loops = [text for text in texts if "\n@compiled\n" in text]
    names = {name for text in loops for name in re.findall(r"^from realizer\.(\S+)", text, re.MULTILINE)}
    files = (folder.parent / f"{name.replace('.', '/')}.py" for name in sorted(names))
    read = [path.read_text("utf-8") for path in files if path.is_file()]
    return hashlib.sha256("\0".join([*loops, *read]).encode()).hexdigest()
