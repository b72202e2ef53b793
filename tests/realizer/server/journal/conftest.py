"""Empty journals: SQLite in a file, and Redis if its server is installed."""

from __future__ import annotations

import shutil
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml

from realizer.server.journal import JournalError, journal_at

COMPOSE = Path(__file__).parents[4] / "docker" / "compose.yaml"


class RedisServer:
    """A Redis server of its own on loopback, run by the command of the compose file."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        with socket.create_server(("127.0.0.1", 0)) as free:
            self._port = free.getsockname()[1]
        self.url = f"redis://127.0.0.1:{self._port}/0"
        self.start()

    def start(self) -> None:
        if shutil.which("redis-server") is None:
            pytest.skip("redis-server is not installed")
        # By default Redis may lose the last two seconds when it is killed and the disk is busy.
        options = ["--appendfsync", "always", "--dir", str(self._folder)]
        options += ["--port", str(self._port), "--bind", "127.0.0.1"]
        command = yaml.safe_load(COMPOSE.read_text("utf-8"))["services"]["journal"]["command"]
        self.process = subprocess.Popen([*command, *options], stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if "Ready to accept connections" in line:
                break

    def kill(self) -> None:
        self.process.kill()
        self.process.communicate()


@pytest.fixture(scope="session")
def redis_url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A Redis server for all."""
    server = RedisServer(tmp_path_factory.mktemp("redis"))
    yield server.url
    server.kill()


@pytest.fixture
def redis_server(tmp_path: Path) -> Iterator[RedisServer]:
    """A server that the test may kill and start again."""
    server = RedisServer(tmp_path)
    yield server
    server.kill()


@pytest.fixture(params=["file", "redis"])
def where(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """The setting `journal`."""
    if request.param == "file":
        return str(tmp_path / "journal.db")
    url: str = request.getfixturevalue("redis_url")
    try:
        journal_at(url).close()
    except JournalError as error:
        pytest.fail(str(error))
    return url


class Clock:
    """The time as the SQLite journal reads it."""

    now = 1000.0


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock()
    monkeypatch.setattr("realizer.server.journal.sqlite_journal.time", lambda: clock.now)
    return clock
