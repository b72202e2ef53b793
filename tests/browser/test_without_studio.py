"""The wheel without realizer_studio plays, and each missing part says in one sentence what it needs."""

from __future__ import annotations

import json
import subprocess
import sys
import venv
import zipfile
from pathlib import Path
from shutil import rmtree
from typing import Any

import numpy as np
import pytest

from tests.browser.test_page import CHROMIUM, PATIENCE, browser, serving
from tests.test_distribution import NAMES, ROOT, build

__all__ = ["browser"]

pytestmark = [
    pytest.mark.slow,
    pytest.mark.browser,
    pytest.mark.xdist_group("browser"),
    pytest.mark.skipif(
        not (ROOT / "pyproject.toml").is_file() or not (ROOT / "realizer/server/static/index.html").is_file(),
        reason="needs a checkout with the page's bundle",
    ),
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
]
BML = '<bml id="b"><speech id="s"><text>Hello there.</text></speech><head id="n" lexeme="NOD"/></bml>'
MISSING = (
    "needs the package realizer_studio, which is not installed: pip install --force-reinstall bml-realizer"
)


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The interpreter of an environment with the wheel without the studio, and with what this one has."""
    place = tmp_path_factory.mktemp("wheel")
    build(ROOT, place, "-t", "wheel")
    venv.create(place / "venv", with_pip=False, symlinks=True)
    (packages,) = (place / "venv").glob("lib/*/site-packages")
    with zipfile.ZipFile(place / NAMES[0]) as archive:
        archive.extractall(packages)
    rmtree(packages / "realizer_studio")
    # A folder in such a file is added as it is: the checkout that is installed in it is not.
    (packages / "others.pth").write_text(str(Path(np.__file__).parents[1]))
    return place / "venv/bin/python"


def run(python: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [str(python), "-m", "realizer", *arguments]
    return subprocess.run(command, cwd=python.parent, capture_output=True, text=True, check=False)


def test_copy_without_the_studio_plays_to_files(python: Path, tmp_path: Path) -> None:
    document = tmp_path / "hello.bml"
    document.write_text(BML)
    for name in ("hello.mp4", "hello.fap", "hello.json", "hello.glb"):
        done = run(python, "realize", str(document), "-o", str(tmp_path / name), "--size", "96x96")
        assert (done.returncode, done.stdout) == (0, ""), done.stderr
        assert (tmp_path / name).stat().st_size > 1000
    for command in (("check", str(document)), ("schedule", str(document)), ("faces", "list"), ("doctor",)):
        assert run(python, *command).returncode == 0
    assert sys.prefix not in run(python, "doctor").stdout


@pytest.mark.parametrize(
    "command",
    [
        "corpus init x",
        "study make x",
        "track film.mp4 -o x.csv",
        "expressions list",
        "align talk.wav words",
        "fap info x.fap",
        "faces check",
        "faces build ada --data x",
        "faces sheet ada -o x.png",
        "realize hello.bml --face head.glb",
    ],
)
def test_missing_command_or_head_says_what_it_needs(python: Path, command: str) -> None:
    (python.parent / "hello.bml").write_text(BML)
    (python.parent / "head.glb").write_bytes(b"glTF")
    done = run(python, *command.split())
    (line,) = done.stderr.splitlines()
    assert line.startswith("realizer: ")
    assert line.endswith(MISSING)
    assert (done.returncode, done.stdout) == (3, "")


def test_help_names_missing_commands(python: Path) -> None:
    done = run(python, "--help")
    assert done.returncode == 0
    assert "corpus" in done.stdout
    assert "Not here" in done.stdout


@pytest.mark.skipif(CHROMIUM is None, reason="no Chromium: apt install chromium")
def test_service_without_the_studio_plays_in_the_page_and_for_clients(python: Path, browser: Any) -> None:
    from websockets.sync.client import connect

    from realizer.client import connect as client_of

    def ask(url: str, message: dict[str, object], wanted: str) -> dict[str, Any]:
        with connect(url) as socket:
            socket.send(json.dumps(message))
            while True:
                text = socket.recv()
                if isinstance(text, str) and text.startswith("{") and wanted in (answer := json.loads(text)):
                    return dict(answer)

    with serving(
        [*map(str, (python, "-P", "-m", "realizer")), "serve", "--port", "0", "--voice", "silent"]
    ) as address:
        page = browser.new_page(bypass_csp=True)
        page.set_default_timeout(PATIENCE)
        page.goto(address)
        page.wait_for_selector('#status[data-state="live"]')
        page.fill("#document", BML)
        page.click("#play")
        page.wait_for_selector("#log li:has-text('n end')")
        for tab, editor in (("face", "studio"), ("design", "design")):
            page.click(f"#tab-{tab}")
            page.wait_for_function(
                "words => document.body.innerText.includes(words)", arg=f"{editor!r} {MISSING}"
            )
        page.close()
        socket = address.replace("http", "ws")
        with client_of(f"{socket}/ws?session=x") as client:
            assert client.play(BML).status == "DONE"
        for editor in ("design", "label", "studio"):
            answer = ask(f"{socket}/{editor}", {"id": 1, "type": "list"}, "error")
            assert answer["error"] == f"{editor!r} {MISSING}"
        answer = ask(f"{socket}/ws", {"type": "track", "fps": 5}, "code")
        assert (answer["code"], answer["where"]) == ("unsupported", "track")
        assert answer["message"].endswith(MISSING)
