"""`compiled`: loops in machine code, or one sentence on what to install."""

import sys

import pytest

from realizer.core.errors import RenderError
from realizer.render.compiled import compiled


def twice(x):
    return 2 * x


@pytest.mark.gl("onboard")
def test_compiled_loops_return_the_same():
    assert compiled(twice)(21) == 42


def test_compiled_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "numba", None)
    with pytest.raises(RenderError, match="pip install"):
        compiled(twice)
