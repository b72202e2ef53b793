"""A real message broker on loopback, started by the test that wants it and ended by its process id."""

from __future__ import annotations

import shutil
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path
from threading import Event, Thread

import pytest

JARS = Path("/usr/share/activemq/lib")  # where Debian's package has them
LIMIT = 60  # s; a hung start ends

CONFIGURATION = """<beans xmlns="http://www.springframework.org/schema/beans"
  xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="
  http://www.springframework.org/schema/beans http://www.springframework.org/schema/beans/spring-beans.xsd
  http://activemq.apache.org/schema/core http://activemq.apache.org/schema/core/activemq-core.xsd">
 <broker xmlns="http://activemq.apache.org/schema/core" brokerName="test" persistent="false" useJmx="false"
   dataDirectory="{folder}">
  {plugins}
  <transportConnectors><transportConnector name="stomp" uri="stomp://127.0.0.1:{port}"/></transportConnectors>
 </broker>
</beans>
"""
# A broker that asks who is there.
PASSWORD = """<plugins><simpleAuthenticationPlugin anonymousAccessAllowed="false"><users>
 <authenticationUser username="face" password="secret" groups="users"/>
</users></simpleAuthenticationPlugin></plugins>"""
LOGGING = """log4j.rootLogger=INFO, out
log4j.appender.out=org.apache.log4j.ConsoleAppender
log4j.appender.out.layout=org.apache.log4j.PatternLayout
log4j.appender.out.layout.ConversionPattern=%m%n
"""


class Broker:
    """ActiveMQ in a process of its own; `start` returns once it listens at `port`."""

    def __init__(self, folder: Path, plugins: str = "") -> None:
        with socket.socket() as taken:
            taken.bind(("127.0.0.1", 0))
            self.port = taken.getsockname()[1]
        self.address = f"127.0.0.1:{self.port}"
        self._folder = folder
        self._process: subprocess.Popen[str] | None = None
        text = CONFIGURATION.format(folder=folder, port=self.port, plugins=plugins)
        (folder / "broker.xml").write_text(text)
        (folder / "log4j.properties").write_text(LOGGING)

    def start(self) -> None:
        folder = self._folder
        homes = [f"-Dactivemq.{name}={folder}" for name in ("base", "conf", "data")]
        command = [
            "java",
            "-Xmx128m",
            "-XX:TieredStopAtLevel=1",  # a broker of a second needs no second compiler
            f"-Djava.io.tmpdir={folder}",
            f"-Dactivemq.home={JARS.parent}",
            *homes,
            f"-Dlog4j.configuration=file:{folder}/log4j.properties",
            "-cp",
            f"{JARS}/*:{JARS}/optional/*",
            "org.apache.activemq.console.Main",
            "start",
            f"xbean:file:{folder}/broker.xml",
        ]
        self._process = subprocess.Popen(
            command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        listening = Event()
        lines: list[str] = []
        Thread(target=self._read, args=(self._process, listening, lines), daemon=True).start()
        assert listening.wait(LIMIT), "".join(lines)
        assert any("Connector stomp started" in line for line in lines), "".join(lines)

    @staticmethod
    def _read(process: subprocess.Popen[str], listening: Event, lines: list[str]) -> None:
        """What it says, up to its end, so that it never waits for a reader."""
        assert process.stdout is not None
        with process.stdout:
            for line in process.stdout:
                lines.append(line)
                if "Connector stomp started" in line:
                    listening.set()
        listening.set()

    def kill(self) -> None:
        """End it as a power cut would."""
        if self._process is not None:
            self._process.kill()
            self._process.wait(LIMIT)
            self._process = None


def _installed() -> None:
    if shutil.which("java") is None or not JARS.is_dir():
        pytest.skip("needs ActiveMQ: apt-get install activemq")


@pytest.fixture(scope="session")
def broker(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Broker]:
    """A broker that all tests share; they must not end it."""
    _installed()
    broker = Broker(tmp_path_factory.mktemp("broker"))
    broker.start()
    yield broker
    broker.kill()


@pytest.fixture
def own_broker(tmp_path: Path) -> Iterator[Broker]:
    """A broker of the test's own, not started yet."""
    _installed()
    broker = Broker(tmp_path)
    yield broker
    broker.kill()


@pytest.fixture
def guarded_broker(tmp_path: Path) -> Iterator[Broker]:
    """A broker that wants the login `face` with the password `secret`."""
    _installed()
    broker = Broker(tmp_path, PASSWORD)
    broker.start()
    yield broker
    broker.kill()
