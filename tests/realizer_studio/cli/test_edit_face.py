"""`realizer faces edit`."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path
from urllib.request import urlopen

import pytest

from tests.commands import run
from tests.waiting import LIMIT


def test_edit_face_of_an_unknown_face_exits_with_2() -> None:
    done = run("faces", "edit", "nobody", "--no-browser")
    assert done.returncode == 2
    assert "nobody" in done.stderr


@pytest.mark.slow
def test_edit_face_serves_the_page_on_a_copy(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "realizer", "faces", "edit", "ada", "--no-browser"]
    environment = {**os.environ, "PYTHONUNBUFFERED": "1", "REALIZER_VOICE": "silent"}
    with subprocess.Popen(
        command, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    ) as service:
        assert service.stdout is not None
        copy, page = (service.stdout.readline().strip() for _ in range(2))
        assert copy.startswith(str(tmp_path / "edited" / "faces" / "ada"))
        address = page.removeprefix("page: ")
        assert address.startswith("http://127.0.0.1:")
        assert address.endswith("/#face")
        with urlopen(address.removesuffix("#face") + "faces/ada") as answer:
            assert answer.read(4) == b"glTF"
        service.send_signal(signal.SIGINT)
        assert service.wait(LIMIT) == 0
    assert (tmp_path / "edited" / "faces" / "ada" / "mesh.npz").is_file()
