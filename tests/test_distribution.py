"""The source distribution and the wheel: the same bytes each time, and from each other."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest
import yaml

from realizer import __version__
from tests.waiting import LIMIT

ROOT = Path(__file__).parent.parent
RELEASE = ROOT / ".github" / "release.sh"
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
    subprocess.run(command, cwd=source, env=environment, check=True, capture_output=True, timeout=LIMIT)
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


@pytest.mark.parametrize(
    ("tag", "wanted"),
    [
        ("v0.0.1", f"tag: wanted v{__version__}, as realizer/__init__.py has it, got v0.0.1"),
        (f"v{__version__}", "wanted a folder that is not there yet"),
    ],
)
def test_release_refuses_a_wrong_tag_and_an_old_folder(tag: str, wanted: str, tmp_path: Path) -> None:
    changelog = (ROOT / "CHANGELOG.md").read_text("utf-8")
    if tag.endswith(__version__) and f"\n## {__version__} - " not in changelog:
        wanted = f"CHANGELOG.md: wanted a heading '## {__version__} - YEAR-MONTH-DAY'"
    done = subprocess.run([RELEASE, tag, tmp_path], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert wanted in done.stderr


def test_release_workflow_runs_scripts_that_are_there() -> None:
    workflow = yaml.safe_load((ROOT / ".github/workflows/release.yml").read_text("utf-8"))
    commands = "\n".join(step["run"] for step in workflow["jobs"]["release"]["steps"] if "run" in step)
    named = set(re.findall(r"(?<![\w/])(?:\.github|docker|clients|realizer)/[\w./-]+", commands))
    assert {".github/release.sh", "docker/requirements.txt"} <= named
    assert all((ROOT / path).exists() for path in named)
    shellcheck = Path(sys.executable).with_name("shellcheck")
    if shellcheck.is_file():
        subprocess.run([shellcheck, "-s", "bash", "-"], input=commands, text=True, check=True)
        subprocess.run([shellcheck, RELEASE], check=True)
