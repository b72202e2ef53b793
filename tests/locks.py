"""The lock files: `python -m tests.locks` writes them, for Python 3.11 on Linux, by uv (extra `dev`).

Each pins every package of some extras of pyproject.toml with the hashes of its files, and names no index.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
IMAGE_EXTRAS = re.search(r"^extras=\$\{2:-(.+)\}$", (ROOT / "docker/install.sh").read_text("utf-8"), re.M)
assert IMAGE_EXTRAS is not None
# File -> its extras.
LOCKS = {
    "docker/requirements.txt": tuple(IMAGE_EXTRAS[1].split(",")),
    ".github/requirements.txt": ("all", "test", "dev"),
}
PYTHON, PLATFORM = "3.11", "x86_64-manylinux_2_28"
HEAD = "# Written by `python -m tests.locks` for Python 3.11 on Linux; extras: {}.\n"


def uv(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run `uv pip compile` on pyproject.toml; uv is beside Python or on the PATH."""
    program = shutil.which("uv", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    if program is None:
        raise SystemExit("wanted uv, which pip install -e '.[dev]' installs")
    options = ["--quiet", "--no-header", "--only-binary", ":all:", "--python-platform", PLATFORM]
    command = [program, "pip", "compile", "pyproject.toml", *options, *arguments]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


def lock(extras: tuple[str, ...]) -> str:
    """Return the text of a lock file.

    Raises:
        SystemExit: no versions go together, or a package has no wheel.
    """
    chosen = (word for extra in extras for word in ("--extra", extra))
    done = uv("--python-version", PYTHON, "--generate-hashes", *chosen)
    if done.returncode != 0:
        raise SystemExit(done.stderr)
    return HEAD.format(", ".join(extras)) + done.stdout


if __name__ == "__main__":
    for file, extras in LOCKS.items():
        (ROOT / file).write_text(lock(extras), "utf-8")
