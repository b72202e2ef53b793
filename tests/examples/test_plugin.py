"""The example plug-in, installed into a fresh environment: a thing of each kind is used."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import site
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from websockets.sync.client import connect

import realizer
from tests.waiting import LIMIT

EXAMPLE = Path(__file__).parents[2] / "examples" / "plugin"
WINK = '<bml id="b" xmlns:e="urn:realizer-example"><e:wink id="w" side="RIGHT" start="0" end="1"/></bml>'
BML = WINK.replace("</bml>", '<speech id="s"><text>Hello there</text></speech></bml>')

pytestmark = [pytest.mark.slow]


@pytest.fixture(scope="module")
def home(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with an environment in which the plug-in is installed, and the document."""
    home = tmp_path_factory.mktemp("plugin")
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", home / "env"], check=True)
    (place,) = (home / "env" / "lib").glob("python*/site-packages")
    # The packages of this environment are there too, so that nothing is fetched; this checkout comes first.
    shared = [str(Path(realizer.__path__[0]).parent), *site.getsitepackages()]
    (place / "shared.pth").write_text("\n".join(shared))
    shutil.copytree(EXAMPLE, home / "source")
    flags = ["--no-deps", "--no-build-isolation", "--no-index", "--quiet", "--disable-pip-version-check"]
    command = [home / "env/bin/python", "-m", "pip", "install", *flags, home / "source"]
    subprocess.run(command, check=True, env=environment(home))
    (home / "b.bml").write_text(BML)
    return home


def environment(home: Path, **more: str) -> dict[str, str]:
    kept = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    return kept | {"XDG_CACHE_HOME": str(home / "cache")} | more


def run(home: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    command = [home / "env/bin/python", "-m", "realizer", *arguments]
    return subprocess.run(
        command, cwd=home, env=environment(home), capture_output=True, text=True, check=True
    )


def test_example_is_short() -> None:
    lines = [line for file in EXAMPLE.iterdir() if file.is_file() for line in file.read_text().splitlines()]
    assert len(lines) < 165


def test_plugins_lists_one_of_each_kind(home: Path) -> None:
    rows = json.loads(run(home, "plugins", "--json").stdout)
    kinds = ["behaviours", "outputs", "voices", "transports", "faces", "editors"]
    assert [row["group"] for row in rows] == [f"realizer.{kind}" for kind in kinds]
    assert {row["package"] for row in rows} == {"realizer-example"}
    assert not [row["fault"] for row in rows if row["fault"]]


def test_behaviour_voice_face_and_output_are_used(home: Path) -> None:
    done = run(home, "realize", "b.bml", "--voice", "hum", "--face", "eve", "--no-idle", "-o", "b.json")
    assert "realizer:" not in done.stderr
    made = json.loads((home / "b.json").read_text())
    assert made["face"] == "eve"
    eye = made["au"]["names"].index("43R")
    assert max(row[eye] for row in made["au"]["values"]) > 0.9
    run(home, "realize", "b.bml", "--voice", "hum", "-o", "b.words")
    assert [line.split()[1] for line in (home / "b.words").read_text().splitlines()] == ["Hello", "there"]
    run(home, "realize", "b.bml", "--voice", "hum", "-o", "b.wav")
    assert (home / "b.wav").stat().st_size > 10_000


def test_behaviour_is_planned_in_other_processes(home: Path) -> None:
    run(home, "batch", "b.bml", "-o", "out", "--format", "words", "--voice", "hum", "--workers", "1")
    (row,) = map(json.loads, (home / "out" / "manifest.jsonl").read_text().splitlines())
    assert row["status"] == "done"
    assert not row.get("warnings")
    assert (home / "out" / "b.words").read_text().startswith("0.")


@pytest.mark.parametrize("workers", ["1", "2"])
def test_transport_takes_lines_and_sends_feedback(home: Path, workers: str) -> None:
    with socket.create_server(("127.0.0.1", 0)) as free:
        port = str(free.getsockname()[1])
    flags = ["--port", "0", "--voice", "hum", "--face", "eve", "--workers", workers]
    service = subprocess.Popen(
        [home / "env/bin/python", "-m", "realizer", "serve", *flags],
        cwd=home,
        env=environment(home, LINES_PORT=port),
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert service.stdout is not None
        said, address = "", None
        while address is None or f"lines: text at 127.0.0.1:{port}" not in said:
            said += (line := service.stdout.readline())
            assert line, said
            address = re.search(r"listening on (ws://\S+)/ws", said)
        with connect(f"{address[1]}/capitals") as page:
            page.send('{"id": 1, "text": "hello"}')
            assert json.loads(page.recv()) == {"id": 1, "text": "HELLO"}
        with socket.create_connection(("127.0.0.1", int(port))) as client, client.makefile("rw") as stream:
            for line in ("Hello", WINK):
                stream.write(line + "\n")
            stream.flush()
            heard = ""
            while 'id="b:end"' not in heard:
                heard += stream.readline()
        assert re.search(r'syncPointProgress [^>]*id="b:w:end"', heard)
        assert 'id="text1:speech:end"' in heard
        assert "warningFeedback" not in heard
    finally:
        service.send_signal(signal.SIGTERM)
        service.communicate(timeout=LIMIT)
