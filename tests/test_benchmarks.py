"""The benchmarks and the training scripts can be imported, each as a program in its folder."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROGRAMS = sorted(path for folder in ("benchmarks", "training") for path in (ROOT / folder).glob("*.py"))
OUTSIDE = {"train_sound_visemes": "jax"}  # needed by a benchmark, and installed by no extra


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_benchmarks_and_training_import(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if path.stem in OUTSIDE:
        pytest.importorskip(OUTSIDE[path.stem])
    monkeypatch.syspath_prepend(path.parent)
    runpy.run_path(str(path), run_name=path.stem)
