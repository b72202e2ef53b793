"""A package with one plug-in of each kind, and one that is broken, in a process of its own."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

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
ADDING = (Path(__file__).parents[1] / "docs" / "adding.md").read_text("utf-8")
YAWN, PLUGIN = re.findall(r"```python\n(.*?)```", ADDING, re.DOTALL)
(PROJECT,) = (tomllib.loads(text)["project"] for text in re.findall(r"```toml\n(.*?)```", ADDING, re.DOTALL))
POINTS = """
[realizer.behaviours]
yawn = yawn:KINDS
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
    (site / "yawn.py").write_text(YAWN)
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
    document = '<bml id="b" xmlns:r="urn:bml-realizer:1"><r:yawn id="y"/></bml>'
    assert "<syncPointProgress" in run(site, "realize", "-", document=document).stdout


def test_plugins_include_the_package_of_the_documentation(site: Path, tmp_path: Path) -> None:
    (document,) = re.findall(r"^echo '(<bml .*)' \|$", ADDING, re.MULTILINE)
    done = run(site, "realize", "-", "-o", str(tmp_path / "yuck.words"), document=document)
    assert (tmp_path / "yuck.words").read_text().startswith("0.000 Yuck")
    assert "sneer" not in done.stderr


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
