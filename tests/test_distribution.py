"""The source distribution and the wheel: the same bytes each time, and from each other."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

from realizer import __version__

ROOT = Path(__file__).parent.parent
NAMES = (f"bml_realizer-{__version__}-py3-none-any.whl", f"bml_realizer-{__version__}.tar.gz")
PARTS = (
    "bml_realizer-{}.dist-info/licenses/LICENSE",
    "bml_realizer-{}.dist-info/licenses/THIRD_PARTY_LICENSES.md",
    "realizer/_faces/ada/mesh.npz",
    "realizer/server/static/index.html",
)


def build(source: Path, target: Path, *options: str) -> list[bytes]:
    """Build a folder without its network; the bytes of what is made, wheel first."""
    pytest.importorskip("hatchling")
    environment = {**os.environ, "PYTHONPATH": ""}
    command = [sys.executable, "-m", "hatchling", "build", "-d", str(target), *options]
    subprocess.run(command, cwd=source, env=environment, check=True, capture_output=True, timeout=120)
    return [(target / name).read_bytes() for name in NAMES if (target / name).is_file()]


@pytest.mark.long
@pytest.mark.slow
@pytest.mark.skipif(
    not (ROOT / "pyproject.toml").is_file() or not (ROOT / "realizer/server/static/index.html").is_file(),
    reason="needs a checkout with the page's bundle",
)
def test_distributions_have_the_same_bytes_from_checkout_and_sdist(tmp_path: Path) -> None:
    wheel, sdist = build(ROOT, tmp_path / "first")
    with tarfile.open(tmp_path / "first" / NAMES[1]) as archive:
        archive.extractall(tmp_path, filter="data")
    assert build(tmp_path / NAMES[1].removesuffix(".tar.gz"), tmp_path / "second", "-t", "wheel") == [wheel]
    assert build(ROOT, tmp_path / "third", "-t", "sdist") == [sdist]
    with zipfile.ZipFile(tmp_path / "first" / NAMES[0]) as archive:
        assert {part.format(__version__) for part in PARTS} <= set(archive.namelist())
        assert not [name for name in archive.namelist() if name.startswith("tests") or "node_modules" in name]
