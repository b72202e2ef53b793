"""A real message broker on loopback, started by the test that wants it and ended by its process id."""

from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path
from threading import Event, Thread

import pytest

from realizer.server.transports.rate_limiter import RateLimiter
from tests.waiting import LIMIT

JARS = Path("/usr/share/activemq/lib")  # where Debian's package has them
RABBIT = Path("/usr/lib/rabbitmq/bin/rabbitmq-server")  # the one on the PATH becomes another user

CONFIGURATION = """<beans xmlns="http://www.springframework.org/schema/beans"
  xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" xsi:schemaLocation="
  http://www.springframework.org/schema/beans http://www.springframework.org/schema/beans/spring-beans.xsd
  http://activemq.apache.org/schema/core http://activemq.apache.org/schema/core/activemq-core.xsd">
 <broker xmlns="http://activemq.apache.org/schema/core" brokerName="test" persistent="false" useJmx="false"
   dataDirectory="{folder}">
  {plugins}
  <transportConnectors>
   <transportConnector name="stomp" uri="stomp://127.0.0.1:{port}?transport.tcpNoDelay=true"/>
  </transportConnectors>
 </broker>
</beans>
"""
# A broker that asks which components there are.
PASSWORD = """<plugins><simpleAuthenticationPlugin anonymousAccessAllowed="false"><users>
 <authenticationUser username="face" password="secret" groups="users"/>
</users></simpleAuthenticationPlugin></plugins>"""
LOGGING = """log4j.rootLogger=INFO, out
log4j.appender.out=org.apache.log4j.ConsoleAppender
log4j.appender.out.layout=org.apache.log4j.PatternLayout
log4j.appender.out.layout.ConversionPattern=%m%n
"""


def free_port() -> int:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        return taken.getsockname()[1]


class Process:
    """A program that runs until it is killed; `start` returns once it has printed `ready`."""

    def __init__(self, command: list[str], ready: str, folder: Path, **variables: str) -> None:
        self._process = subprocess.Popen(
            command,
            cwd=folder,
            env={**os.environ, **variables},
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
        )
        self._ready = Event()
        self._lines: list[str] = []
        self._reader = Thread(target=self._read, args=(ready,), daemon=True)
        self._reader.start()
        assert self._ready.wait(LIMIT), "".join(self._lines)
        assert any(ready in line for line in self._lines), "".join(self._lines)

    def _read(self, ready: str) -> None:
        """Read its output to the end, so that it never blocks."""
        assert self._process.stdout is not None
        with self._process.stdout as said:
            for line in said:
                self._lines.append(line)
                if ready in line:
                    self._ready.set()
        self._ready.set()

    def send(self, signal: signal.Signals) -> None:
        self._process.send_signal(signal)

    def kill(self, pid: int | None = None) -> None:
        """End it as a power cut would; with `pid` the child that ends it by its own end."""
        os.kill(pid or self._process.pid, signal.SIGKILL)
        self._process.wait(LIMIT)
        self._reader.join(LIMIT)


class Broker:
    """ActiveMQ in a process of its own; `start` returns once it listens at `port`."""

    def __init__(self, folder: Path, plugins: str = "") -> None:
        self.port = free_port()
        self.address = f"127.0.0.1:{self.port}"
        self._folder = folder
        self._process: Process | None = None
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
        self._process = Process(command, "Connector stomp started", folder)

    def freeze(self) -> None:
        """Stop the process, which keeps its connections."""
        assert self._process is not None
        self._process.send(signal.SIGSTOP)

    def thaw(self) -> None:
        assert self._process is not None
        self._process.send(signal.SIGCONT)

    def kill(self) -> None:
        """End it as a power cut would."""
        if self._process is not None:
            self._process.kill()
            self._process = None


class Rabbit:
    """RabbitMQ with its STOMP plugin; `start` returns once it listens at `port`."""

    def __init__(self, folder: Path) -> None:
        self.port = free_port()
        self.address = f"127.0.0.1:{self.port}"
        self._folder = folder
        (folder / "rabbitmq.conf").write_text(
            f"listeners.tcp = none\nstomp.listeners.tcp.1 = 127.0.0.1:{self.port}\n"
        )
        (folder / "enabled_plugins").write_text("[rabbitmq_stomp].\n")

    def start(self) -> None:
        folder = str(self._folder)
        names = str(free_port())
        # The name server of its runtime, or it starts one that outlives it.
        self._names = Process(["epmd", "-d", "-port", names, "-address", "127.0.0.1"], "epmd", self._folder)
        self._process = Process(
            [str(RABBIT)],
            "Server startup complete",
            self._folder,
            HOME=folder,
            ERL_EPMD_PORT=names,
            RABBITMQ_DIST_PORT=str(free_port()),
            RABBITMQ_NODENAME="test@localhost",
            RABBITMQ_MNESIA_BASE=folder,
            RABBITMQ_LOG_BASE=folder,
            RABBITMQ_LOGS="-",
            RABBITMQ_CONFIG_FILE=f"{folder}/rabbitmq.conf",
            RABBITMQ_ENABLED_PLUGINS_FILE=f"{folder}/enabled_plugins",
            RABBITMQ_PID_FILE=f"{folder}/pid",
            RABBITMQ_SERVER_ADDITIONAL_ERL_ARGS="-kernel inet_dist_use_interface {127,0,0,1}",
        )

    def kill(self) -> None:
        self._process.kill(int((self._folder / "pid").read_text()))
        self._names.kill()


def _installed() -> None:
    if shutil.which("java") is None or not JARS.is_dir():
        pytest.skip("needs ActiveMQ: apt-get install activemq")


@pytest.fixture(scope="module")
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


@pytest.fixture(scope="module")
def rabbit(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Rabbit]:
    """The other broker that laboratories run."""
    if not RABBIT.is_file() or shutil.which("epmd") is None:
        pytest.skip("needs RabbitMQ: apt-get install rabbitmq-server")
    rabbit = Rabbit(tmp_path_factory.mktemp("rabbit"))
    rabbit.start()
    yield rabbit
    rabbit.kill()


@pytest.fixture
def all_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let messages come at one instant, however slowly this machine sends them, with short pauses."""
    wait = RateLimiter.wait
    monkeypatch.setattr(RateLimiter, "wait", lambda limiter, _, *count: min(wait(limiter, 0.0, *count), 0.01))
