"""A package with one plug-in of each kind, and one that is broken, in a process of its own."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.rows import each_row

CODE = '''
from pathlib import Path
from bml_schema.node_schema import node
from bml_schema.nodes import Behaviour
from realizer.behaviours.kind import BehaviourKind
from realizer.behaviours.kind import table_timing
from realizer.outputs.output import Output
from realizer.speech.base_voice import BaseVoice

@node
class Shrug(Behaviour):
    """Do nothing for a while."""
    tag = "{urn:test}shrug"

KINDS = (BehaviourKind(Shrug, table_timing("idle")),)
COUNT = Output(".count", "text/plain", "the number of frames", lambda played, drawing: b"%d" % played.frames)
FACES = Path(__file__).parent / "faces"

class Quiet(BaseVoice):
    name = "quiet"
    description = "a voice that is never heard"
    def say(self, request): raise NotImplementedError
'''
ROOT = Path(__file__).parents[1]
ADDING = (ROOT / "docs" / "adding.md").read_text("utf-8")
PYTHON = YAWN, PLUGIN = re.findall(r"```python\n(.*?)```", ADDING, re.DOTALL)
(PROJECT,) = (tomllib.loads(text)["project"] for text in re.findall(r"```toml\n(.*?)```", ADDING, re.DOTALL))
POINTS = """
[realizer.behaviours]
doze = doze:KINDS
shrug = plug:KINDS
broken = plug:NOTHING
[realizer.outputs]
.count = plug:COUNT
[realizer.voices]
quiet = plug:Quiet
[realizer.faces]
mine = plug:FACES
"""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    site = tmp_path_factory.mktemp("site")
    (site / "plug.py").write_text(CODE)
    # Under another name, so that the tests pass in a copy of the project that has the behaviour.
    (site / "doze.py").write_text(YAWN.replace('own("yawn")', 'own("doze")'))
    (site / "my_plugin.py").write_text(PLUGIN)
    groups = PROJECT["entry-points"].items()
    points = "".join(
        f"[{group}]\n" + "".join(f"{n} = {at}\n" for n, at in rows.items()) for group, rows in groups
    )
    for name, text in (("plug", POINTS), (PROJECT["name"], points)):
        info = site / f"{name.replace('-', '_')}-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(text)
    (site / "faces" / "eve").mkdir(parents=True)
    (site / "faces" / "eve" / "face.toml").write_text(
        'name = "eve"\nsource = "a test"\nlicence = "MIT"\n[parts]\n'
    )
    return site


def run(site: Path, *arguments: str, document: str = "") -> subprocess.CompletedProcess[str]:
    path = os.pathsep.join(p for p in (os.environ.get("PYTHONPATH"), str(site)) if p)
    command = [sys.executable, "-m", "realizer", *arguments]
    return subprocess.run(
        command,
        input=document,
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": path},
        check=True,
    )


def test_plugins_include_the_example_of_the_documentation(site: Path) -> None:
    document = '<bml id="b" xmlns:r="urn:bml-realizer:1"><r:doze id="y"/></bml>'
    assert "<syncPointProgress" in run(site, "realize", "-", document=document).stdout


@pytest.mark.parametrize("code", PYTHON, ids=["yawn", "plugin"])
def test_plugins_of_the_documentation_suit_the_linter(code: str) -> None:
    for check in (["check"], ["format", "--check"]):
        command = [sys.executable, "-m", "ruff", *check, "--stdin-filename", "realizer/page.py", "-"]
        done = subprocess.run(command, input=code, capture_output=True, text=True, cwd=ROOT, check=False)
        assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.slow
def test_plugins_of_the_documentation_have_types(tmp_path: Path) -> None:
    for number, code in enumerate(PYTHON):
        (tmp_path / f"page{number}.py").write_text(code)
    command = [sys.executable, "-m", "mypy", *map(str, sorted(tmp_path.glob("*.py")))]
    done = subprocess.run(command, capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.returncode == 0, done.stdout


def test_plugins_include_the_package_of_the_documentation(site: Path, tmp_path: Path) -> None:
    (document,) = re.findall(r"^echo '(<bml .*)' \|$", ADDING, re.MULTILINE)
    done = run(site, "realize", "-", "-o", str(tmp_path / "yuck.said"), document=document)
    assert (tmp_path / "yuck.said").read_text().startswith("0.000 Yuck")
    assert "sneer" not in done.stderr


def test_plugins_of_the_documentation_and_the_example_have_different_names() -> None:
    example = tomllib.loads((ROOT / "examples" / "plugin" / "pyproject.toml").read_text("utf-8"))["project"]
    for group, rows in PROJECT["entry-points"].items():
        assert not rows.keys() & example["entry-points"].get(group, {}).keys()


MODULES = ("realization", "playback.player", "pipeline", "outputs", "behaviours.registry", "offline")


@each_row("module", MODULES)
def test_plugins_may_import_the_result_whatever_is_imported_first(site: Path, module: str) -> None:
    code = f"import realizer.{module}; from realizer.behaviours.registry import KINDS; print(*KINDS)"
    path = os.pathsep.join(p for p in (os.environ.get("PYTHONPATH"), str(site)) if p)
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        env={**os.environ, "PYTHONPATH": path},
        cwd=ROOT,
        check=True,
    )
    assert "{urn:mine}sneer" in done.stdout.split(), done.stderr


def test_plugins_bring_a_command(site: Path) -> None:
    said = run(site, "sneer", "Yuck.").stdout
    assert re.search(r"sneer +Print a document", run(site, "--help").stdout)
    assert run(site, "check", "-", document=said).stdout == ""


def test_plugins_bring_a_behaviour_and_an_output(site: Path, tmp_path: Path) -> None:
    document = '<bml id="b" xmlns:p="urn:test"><p:shrug id="s" start="0" end="1"/></bml>'
    done = run(site, "realize", "-", "-o", str(tmp_path / "x.count"), document=document)
    assert (tmp_path / "x.count").read_text() == "26"
    (line,) = [line for line in done.stderr.splitlines() if "plug-in" in line]
    assert "plug-in 'broken' of plug (realizer.behaviours, plug:NOTHING) cannot be imported" in line


@pytest.mark.parametrize(
    ("command", "line"),
    [
        (["outputs"], ".count"),
        (["voices"], "quiet            a voice that is never heard"),
        (["faces", "list"], "eve"),
    ],
    ids=["outputs", "voices", "faces"],
)
def test_plugins_are_listed(site: Path, command: list[str], line: str) -> None:
    assert any(said.startswith(line) for said in run(site, *command).stdout.splitlines())
