"""The processor for Pipecat, in real pipelines, in an environment of its own: `pytest -m slow --pipecat`."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from tests.programs import serving
from tests.waiting import LIMIT

ROOT = Path(__file__).parents[2]
# What the client of the realizer needs beside Pipecat.
PACKAGES = ("pipecat-ai>=1.10,<2", "websockets", "pydantic", "numpy", "lxml", "pillow")

pytestmark = [pytest.mark.slow, pytest.mark.espeak]


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory, pytestconfig: pytest.Config) -> Path:
    """The Python of an environment with Pipecat."""
    if not pytestconfig.getoption("--pipecat"):
        pytest.skip("installs an environment for minutes: wants the option --pipecat")
    place = tmp_path_factory.mktemp("pipecat") / "env"
    subprocess.run([sys.executable, "-m", "venv", place], check=True)
    found = place / "bin" / "python"
    command = [found, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *PACKAGES]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"pipecat-ai could not be installed: {done.stderr.strip().splitlines()[-1:]}")
    return found


@pytest.fixture(scope="module")
def converse(python: Path) -> Iterator[Callable[..., dict[str, Any]]]:
    """Return a function that runs the dialogue with options, and returns what it prints."""
    with serving("--voice", "espeak", "--no-idle") as (address, _):

        def run(*options: str) -> dict[str, Any]:
            command = [python, ROOT / "examples" / "pipecat" / "dialogue.py", address, *options]
            done = subprocess.run(
                command,
                env={**os.environ, "PYTHONPATH": str(ROOT)},
                capture_output=True,
                text=True,
                timeout=LIMIT,
            )
            assert done.returncode == 0, done.stderr[-2000:]
            result: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
            return result

        yield run


@pytest.mark.parametrize("options", [(), ("--foreign-voice",)])
def test_face_stops_when_the_user_speaks_and_the_context_has_the_rest(converse, options) -> None:
    each = converse(*options)
    story = "Once there was a face that talked and talked, and nobody could ever make it stop"
    (ask, asked), (who, heard), (_, stop), (_, last) = each["context"]
    assert (ask, asked, who, stop) == ("user", "Tell me a story.", "assistant", "Stop, please.")
    assert story.startswith(heard)
    assert 3 <= len(heard.split()) <= 8
    assert last == "I stop now."
    # The words of the first answer come before the interruption, those of the second one after it.
    cut = each["heard"].index("|", 1)
    assert " ".join(each["heard"][1:cut]) == heard
    assert " ".join(each["heard"][cut + 1 :]) == last
    assert each["faps"] > 50
    print("silent after", each["silence_ms"], "ms")
