"""`compiled`: loops in machine code, or one sentence on what to install."""

import sys

import pytest

from realizer.core.errors import RenderError
from realizer.render.compiled import compiled, state_of_sources


def twice(x):
    return 2 * x


@pytest.mark.gl("onboard")
def test_compiled_loops_return_the_same():
    assert compiled(twice)(21) == 42


def test_compiled_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "numba", None)
    with pytest.raises(RenderError, match="pip install"):
        compiled(twice)


LOOP = "from realizer.face.parts import EYE\n\n\n@compiled\ndef loop(): ...\n"


@pytest.mark.parametrize(
    ("path", "is_compiled_again"),
    [("render/loops.py", True), ("face/parts.py", True), ("render/camera.py", False)],
)
def test_compiled_loops_are_cached_until_what_they_use_changes(tmp_path, path, is_compiled_again):
    texts = {"render/loops.py": LOOP, "face/parts.py": "EYE = 1\n", "render/camera.py": "NEAR = 1\n"}
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    state_of_sources.cache_clear()
    before = state_of_sources(tmp_path / "render")
    (tmp_path / path).write_text(texts[path] + "# changed\n")
    state_of_sources.cache_clear()
    assert (state_of_sources(tmp_path / "render") != before) == is_compiled_again
    state_of_sources.cache_clear()
