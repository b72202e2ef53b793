"""The benchmarks and the training scripts: each is a program, and what ships names those that made it."""

from __future__ import annotations

import hashlib
import re
import runpy
from fnmatch import fnmatch
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PROGRAMS = sorted(path for folder in ("benchmarks", "training") for path in (ROOT / folder).glob("*.py"))
SHIPPED = sorted(
    path.relative_to(ROOT).as_posix()
    for folder in ("bml_schema", "faces", "realizer", "realizer_studio")
    for path in (ROOT / folder).rglob("*")
    if path.suffix in (".npz", ".tflite")
)
OUTSIDE = {"train_sound_visemes": "jax"}  # needed by a benchmark, and installed by no extra


@pytest.mark.parametrize("path", PROGRAMS, ids=lambda path: path.stem)
def test_benchmarks_and_training_import(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    if path.stem in OUTSIDE:
        pytest.importorskip(OUTSIDE[path.stem])
    monkeypatch.syspath_prepend(path.parent)
    runpy.run_path(str(path), run_name=path.stem)


def rows() -> dict[str, list[str]]:
    """Return file or pattern -> the other cells of its row in training/README.md."""
    rows: dict[str, list[str]] = {}
    for line in (ROOT / "training/README.md").read_text("utf-8").splitlines():
        files, *cells = (cell.strip() for cell in line.strip("|").split("|"))
        names = re.findall("`(.+?)`", files)
        rows |= {name if "/" in name else str(Path(names[0]).parent / name): cells for name in names}
    return rows


@pytest.mark.parametrize("file", SHIPPED)
def test_each_shipped_array_and_network_has_its_script_and_seed(file: str) -> None:
    beginning, script, seed, *_ = next(cells for name, cells in rows().items() if fnmatch(file, name))
    if file.startswith("faces/"):
        assert beginning == "one for each"
    else:
        assert hashlib.sha256((ROOT / file).read_bytes()).hexdigest().startswith(beginning)
        assert len(beginning) == 16
    for name in re.findall(r"training/\w+\.py", script):
        assert (ROOT / name).is_file()
    assert seed or script.startswith("none")
