"""The lock files: `python -m tests.locks` writes them, by pip-compile (extra `dev`) in Python 3.11.

Each pins every package of some extras of pyproject.toml with the hashes of its files, and names no index.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
IMAGE_EXTRAS = re.search(r"^extras=\$\{2:-(.+)\}$", (ROOT / "docker/install.sh").read_text("utf-8"), re.M)
assert IMAGE_EXTRAS is not None
# File -> its extras.
LOCKS = {
    "docker/requirements.txt": tuple(IMAGE_EXTRAS[1].split(",")),
    ".github/requirements.txt": ("all", "test", "dev"),
}
PYTHON = "3.11"
# Conditions of packages tell 3.11.2 from 3.11.3; the image has the newest 3.11.
HEAD = "# Written by `python -m tests.locks` for Python 3.11.3 and later 3.11 on Linux; extras: {}.\n"
# Not uv, which takes versions that exclude this Python. Extras name the project itself, which gets no pin.
OPTIONS = (
    "--quiet",
    "--upgrade",
    "--generate-hashes",
    "--strip-extras",
    "--no-header",
    "--no-emit-options",
    "--no-emit-index-url",
    "--no-emit-find-links",
    "--no-emit-trusted-host",
    "--output-file=-",
    "--unsafe-package=bml-realizer",
    "--pip-args=--only-binary :all:",
)


def requirements(python: str, extras: Iterable[str]) -> Iterator[Requirement]:
    """Yield what the project and some of its extras ask for in a version of Python on Linux."""
    linux = {"python_version": python, "python_full_version": f"{python}.0", "sys_platform": "linux"}
    linux |= {"platform_system": "Linux", "platform_machine": "x86_64", "os_name": "posix"}
    words = [*PROJECT["dependencies"], *(f"{PROJECT['name']}[{extra}]" for extra in extras)]
    for requirement in map(Requirement, words):
        if requirement.name == PROJECT["name"]:
            for extra in requirement.extras:
                words += PROJECT["optional-dependencies"][extra]
        elif requirement.marker is None or requirement.marker.evaluate(linux):
            yield requirement


def lock(extras: tuple[str, ...]) -> str:
    """Return the text of a lock file.

    Raises:
        CalledProcessError: no versions go together, or a package has no wheel.
    """
    chosen = [word for extra in extras for word in ("--extra", extra)]
    command = [sys.executable, "-m", "piptools", "compile", "pyproject.toml", *chosen, *OPTIONS]
    done = subprocess.run(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, check=True)
    pins = done.stdout.partition("\n# The following packages")[0]  # nothing but the project itself follows
    return f"{HEAD.format(', '.join(extras))}{pins.rstrip()}\n"


def main() -> None:
    if sys.platform != "linux" or not (3, 11, 3) <= sys.version_info < (3, 12):
        raise SystemExit(
            f"wanted Python 3.11.3 or a later 3.11 on Linux, got {sys.version.split()[0]} on {sys.platform}"
        )
    for file, extras in LOCKS.items():
        (ROOT / file).write_text(lock(extras), "utf-8")


if __name__ == "__main__":
    main()
