"""The licences of what ships: `python -m tests.licences` writes THIRD_PARTY_LICENSES.md, a file of the wheel.

Each table says in its head where it comes from and under what licence; each face does so in its face.toml;
the packages of the page have their LICENSE beside their code. What cannot say so itself stands in `DATA`.
"""

from __future__ import annotations

import importlib.util
import re
import subprocess
import tomllib
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path

ROOT = Path(__file__).parents[1]
FILE = ROOT / "THIRD_PARTY_LICENSES.md"
WEB = ROOT / "realizer" / "server" / "web"
PAGE = "## The page\n"
# Files without a head: pattern, source, licence.
DATA = (
    (
        "realizer_studio/tracking/models/*.tflite",
        "MediaPipe by Google, wheel mediapipe 0.10.21, unchanged",
        "Apache-2.0, below",
    ),
    (
        "realizer_studio/tracking/weights.npz",
        "trained by training/train_action_units.py on pictures of our own heads",
        "MIT",
    ),
    (
        "realizer/speech/sound_visemes/weights.npz",
        "trained by training/train_sound_visemes.py on synthesized and recorded speech, of which it "
        "contains nothing; weights.txt beside it names the voices",
        "MIT",
    ),
    (
        "realizer/tables/environments.npz",
        "panoramas of Poly Haven (polyhaven.com/hdris) in the npm package @pmndrs/assets 1.7.0, turned, "
        "dimmed and filtered by training/environments.py",
        "CC0-1.0",
    ),
    ("realizer/examples/*", "documents, and pictures drawn by the realizer", "MIT; pictures CC0-1.0"),
)
# What has no content that could belong to others.
CODE = (".py", ".js", ".ts", ".glsl", ".html", ".css", ".typed", ".md", ".xsd", ".json", ".txt", ".npmrc")
HEAD = """# Licences of what ships

Written by `python -m tests.licences`; a test compares it with what is there.

The code is under the MIT licence (LICENSE). This file lists what else is in the wheel. Packages that pip
installs beside it have licences of their own; of these, espeak-ng (extra `speech`) is under the GPL-3 and
runs in a process of its own, and the FFmpeg in PyAV (extra `film`) contains libx264 under the GPL-2 or later.
"""


def text() -> str:
    """Return the file, without the packages of the page.

    Raises:
        ValueError: a file that ships says nowhere under what licence.
    """
    parts = [HEAD, "## Faces\n", *_table(_faces()), "\n## Networks, light and pictures\n"]
    parts += _table((pattern, source, licence) for pattern, source, licence in DATA)
    parts += ["\n## Tables\n", *_table(_tables())]
    missing = sorted(path for path in shipped() if not _covered(path))
    if missing:
        raise ValueError(f"files without a licence, wanted a line in DATA of tests/licences.py: {missing}")
    apache = (ROOT / "realizer_studio/tracking/models/LICENSE").read_text("utf-8").strip()
    return (
        "\n".join([*parts, "\n## Apache-2.0, of the networks of MediaPipe\n", "```text", apache, "```"])
        + "\n"
    )


def page() -> str:
    """Return the licences of the packages in the page's code; needs its node_modules."""
    spec = importlib.util.spec_from_file_location("hatch_build", ROOT / "hatch_build.py")
    assert spec is not None
    assert spec.loader is not None
    hook = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(hook)
    return f"\n{PAGE}\n```text\n{hook.notices().strip()}\n```\n"


def shipped() -> list[str]:
    """Return the files of the repository that are in the wheel."""
    listed = ("git", "ls-files", "realizer", "realizer_studio", "bml_schema", "faces")
    files = subprocess.run(listed, cwd=ROOT, capture_output=True, text=True, check=True).stdout.split("\n")
    return [path for path in files if path and not path.startswith("realizer/server/web/")]


def head_of(path: Path) -> dict[str, str]:
    """Return the lines `# source: ...` and `# licence: ...` of a table."""
    lines = path.read_text("utf-8").split("\n")
    return dict(re.findall(r"^# (source|licence): (.+)$", "\n".join(lines[:60]), re.M))


def _faces() -> Iterator[tuple[str, str, str]]:
    for path in sorted((ROOT / "faces").glob("*/face.toml")):
        facts = tomllib.loads(path.read_text("utf-8"))
        yield f"faces/{path.parent.name}", facts["source"], facts["licence"]


def _tables() -> Iterator[tuple[str, str, str]]:
    for name in shipped():
        if _is_table(name):
            facts = head_of(ROOT / name)
            if "licence" not in facts:
                raise ValueError(f"{name}: wanted a line `# licence: ...`, found none")
            yield name, facts.get("source", ""), facts["licence"]


def _is_table(name: str) -> bool:
    return not name.startswith("faces/") and (name.endswith((".csv", ".toml")) or "/au_to_fap_" in name)


def _covered(name: str) -> bool:
    """Return whether a file is code, a table, a part of a face, or described in `DATA`."""
    described = any(fnmatch(name, pattern) for pattern, _, _ in DATA)
    return described or _is_table(name) or name.startswith("faces/") or name.endswith((*CODE, "/LICENSE"))


def _table(rows: Iterator[tuple[str, str, str]]) -> list[str]:
    lines = ["| what | from | licence |", "|---|---|---|"]
    return lines + [
        "| " + " | ".join(cell.replace("|", "\\|") for cell in (f"`{a}`", b, c)) + " |" for a, b, c in rows
    ]


if __name__ == "__main__":
    FILE.write_text(text() + page(), "utf-8")
