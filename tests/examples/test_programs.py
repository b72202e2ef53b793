"""The example programs run, and do what they say."""

from __future__ import annotations

import csv
import json
import re
import socket
import subprocess
import sys
import wave
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from realizer.client import connect
from tests.portraits import LITERT
from tests.programs import running, serving

EXAMPLES = Path(__file__).parents[2] / "examples"
PROGRAMS = sorted(EXAMPLES.glob("*.py"))
# It is a tutorial in one file.
LONG = {"dialogue.py"}
HELLO = '<bml id="b"><speech id="s"><text>Hello there, my friend.</text></speech></bml>'

pytestmark = pytest.mark.slow


@pytest.fixture
def run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[..., str]:
    """Return a function that runs an example with arguments, and returns what it prints."""
    monkeypatch.setenv("REALIZER_VOICE", "silent")

    def run(name: str, *arguments: str) -> str:
        command = [sys.executable, str(EXAMPLES / name), *arguments]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with serving() as (address, _):
        yield address


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as found:
        found.bind(("127.0.0.1", 0))
        port: int = found.getsockname()[1]
        return port


def table_of(path: Path) -> list[dict[str, str]]:
    return list(csv.DictReader(path.read_text("utf-8").splitlines()))


def test_programs_are_short_and_say_how_to_run_them() -> None:
    for program in PROGRAMS:
        text = program.read_text("utf-8")
        assert program.name in LONG or len(text.splitlines()) <= 100, program.name
        assert re.search(r'^""".*^ *(python|uvicorn|realizer) .*^"""', text, re.M | re.S), program.name


@pytest.mark.gl
@pytest.mark.long
def test_film_from_text_makes_a_film(run: Callable[..., str], tmp_path: Path) -> None:
    assert "film.mp4" in run("film_from_text.py", "Are you sure? Nonsense!", "film.mp4")
    assert (tmp_path / "film.mp4").stat().st_size > 20_000


def test_streaming_model_nods_at_its_point(run: Callable[..., str], address: str) -> None:
    lines = run("streaming_model.py", f"{address}?session=streams").splitlines()
    assert re.fullmatch(r"ended at [\d.]+ s", lines[0])
    assert re.fullmatch(r"nodded at [\d.]+ s", lines[1])


@pytest.mark.parametrize("table", [["words.csv"], []], ids=["words", "sound alone"])
def test_foreign_voice_is_spoken(
    table: list[str], run: Callable[..., str], address: str, tmp_path: Path
) -> None:
    with wave.open(str(tmp_path / "speech.wav"), "wb") as sound:
        sound.setparams((1, 2, 16000, 0, "NONE", ""))
        sound.writeframes((6000 * np.sin(np.arange(16000) * 0.06)).astype(np.int16).tobytes())
    (tmp_path / "words.csv").write_text("0.1,Hello\n0.5,there\n", "utf-8")
    assert "spoken until" in run("foreign_voice.py", address, "speech.wav", *table)


def test_game_engine_prints_the_jaw(tmp_path: Path) -> None:
    port = free_port()
    receiver = [sys.executable, str(EXAMPLES / "game_engine.py"), str(port), "40"]
    with (
        running(receiver) as engine,
        serving("--vmc", f"127.0.0.1:{port}") as (address, _),
        connect(address) as client,
    ):
        client.play(HELLO)
        assert engine.stdout is not None
        bars = [engine.stdout.readline().strip() for _ in range(40)]
    assert max(map(len, bars)) > 3


def test_batch_table_has_a_row_a_text(run: Callable[..., str], tmp_path: Path) -> None:
    (tmp_path / "texts.txt").write_text("Yes.\n\nI am not sure about that.\n", "utf-8")
    run("batch_table.py", "texts.txt", "results.csv")
    rows = table_of(tmp_path / "results.csv")
    assert [row["text"] for row in rows] == ["Yes.", "I am not sure about that."]
    assert float(rows[1]["seconds"]) > float(rows[0]["seconds"]) > 0.3
    assert all(float(row["jaw"]) > 50 for row in rows)


def test_experiment_makes_the_same_stimuli_twice(run: Callable[..., str], tmp_path: Path) -> None:
    for folder in ("one", "two"):
        run("experiment.py", folder, ".fap")
    rows = table_of(tmp_path / "one" / "stimuli.csv")
    assert len(rows) == 12
    for row in rows:
        assert (tmp_path / "one" / row["file"]).read_bytes() == (tmp_path / "two" / row["file"]).read_bytes()
    assert len(list((tmp_path / "one").glob("*.textgrid"))) == 12


@pytest.mark.gl
def test_fastapi_app_has_the_face_and_makes_films(monkeypatch: pytest.MonkeyPatch) -> None:
    testclient = pytest.importorskip("fastapi.testclient")
    monkeypatch.setenv("REALIZER_VOICE", "silent")
    monkeypatch.syspath_prepend(str(EXAMPLES))
    import fastapi_app

    with testclient.TestClient(fastapi_app.app, base_url="http://localhost") as client:
        assert "/face/" in client.get("/").text
        assert client.get("/face/healthz").json()["status"] == "ok"
        assert client.get("/say", params={"text": "Hi"}).content[8:12] == b"WEBP"


@LITERT
@pytest.mark.gl
@pytest.mark.long
def test_track_and_replay_plays_a_film_on_another_head(run: Callable[..., str], tmp_path: Path) -> None:
    import realizer

    smile = '<bml id="b"><faceLexeme id="f" lexeme="SMILE" start="0.3" end="1.2"/></bml>'
    realizer.realize(smile, idle=False, fps=10).save(tmp_path / "talk.mp4", size=(320, 320))
    assert "again.webp" in run("track_and_replay.py", "talk.mp4", "ben", "again.webp")
    with Image.open(tmp_path / "again.webp") as picture:
        assert picture.n_frames > 5


@pytest.mark.gl
@pytest.mark.long
def test_notebook_runs_from_top_to_bottom(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("REALIZER_VOICE", "silent")
    names: dict[str, object] = {}
    for cell in json.loads((EXAMPLES / "notebook.ipynb").read_text("utf-8"))["cells"]:
        if cell["cell_type"] == "code":
            exec("".join(cell["source"]), names)
    assert (tmp_path / "hello.webp").stat().st_size > 10_000
    assert "<video" in names["r"]._repr_html_()  # type: ignore[attr-defined]


@pytest.mark.espeak
def test_languages_speaks_each_of_them(run: Callable[..., str], tmp_path: Path, monkeypatch) -> None:
    monkeypatch.setenv("REALIZER_VOICE", "espeak")
    lines = run("languages.py", "de", "ru").splitlines()
    assert [line.partition(":")[0] for line in lines] == ["de.TextGrid", "ru.TextGrid"]
    assert all(float(re.findall(r"by ([\d.]+)", line)[0]) > 0.2 for line in lines)
    assert '"Guten"' in (tmp_path / "de.TextGrid").read_text("utf-8")
    assert "лицо" in (tmp_path / "ru.TextGrid").read_text("utf-8")
