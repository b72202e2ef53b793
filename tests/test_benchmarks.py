"""The benchmarks, which are no tests, follow the code: each can be imported, as a program in its folder."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

FOLDER = Path(__file__).parent / "benchmarks"
OUTSIDE = {"train_sound_visemes": "jax"}  # needed by a benchmark, and installed by no extra


@pytest.mark.parametrize("path", sorted(FOLDER.glob("*.py")), ids=lambda path: path.stem)
def test_benchmarks_import(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if path.stem in OUTSIDE:
        pytest.importorskip(OUTSIDE[path.stem])
    monkeypatch.syspath_prepend(FOLDER)
    runpy.run_path(str(path), run_name=path.stem)
