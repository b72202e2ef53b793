"""Two nodes that share a journal, behind the proxy that ships; the one that has the session is killed."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator, Sequence
from contextlib import AsyncExitStack, ExitStack, contextmanager
from functools import cached_property
from pathlib import Path
from typing import IO

import pytest
import yaml
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus

from bml_schema.feedback import parse_feedback
from tests.feedback_log import read_feedback, seq_numbers
from tests.waiting import LIMIT

CONFIGURATION = Path(__file__).parents[4] / "docker" / "haproxy.cfg"
pytestmark = pytest.mark.xdist_group("fleet")

FIRST = """<bml id="a"><head id="n" lexeme="NOD" start="0.6"/>
<speech id="s" start="0.3"><text>What is said <sync id="m"/> before it dies</text></speech></bml>"""
NEXT = '<bml id="b" composition="APPEND"><head id="n" lexeme="SHAKE" end="0.8"/></bml>'


class Node:
    """A service. `kill` is that of the system, without warning."""

    def __init__(self, journal: str) -> None:
        command = [sys.executable, "-m", "realizer", "serve", "--port", "0", "--voice", "silent"]
        self._process = subprocess.Popen([*command, "--journal", journal], stdout=subprocess.PIPE, text=True)

    @cached_property
    def address(self) -> str:
        """Its address, as soon as it listens."""
        assert self._process.stdout is not None
        return self._process.stdout.readline().split()[2].removeprefix("ws://").removesuffix("/ws")

    def sessions(self) -> int:
        with urllib.request.urlopen(f"http://{self.address}/healthz") as answer:
            count: int = json.load(answer)["sessions"]
        return count

    def kill(self) -> None:
        os.kill(self._process.pid, signal.SIGKILL)

    def close(self) -> None:
        self._process.kill()
        self._process.communicate()


@contextmanager
def proxy(nodes: Sequence[Node], log: IO[str], **settings: str) -> Iterator[str]:
    """HAProxy with the configuration that ships, in front of two nodes; its address."""
    if (program := shutil.which("haproxy")) is None:
        pytest.skip("haproxy is not installed")
    with socket.create_server(("127.0.0.1", 0)) as listening:
        names = {f"NODE_{number}": node.address for number, node in enumerate(nodes, 1)}
        process = subprocess.Popen(
            [program, "-db", "-f", str(CONFIGURATION)],
            env={**os.environ, **names, **settings, "PROXY_LISTEN": f"fd@{listening.fileno()}"},
            pass_fds=[listening.fileno()],
            stdout=log,
        )
        try:
            yield f"127.0.0.1:{listening.getsockname()[1]}"
        finally:
            process.kill()
            process.wait()


@contextmanager
def two_nodes(redis_url: str) -> Iterator[tuple[Node, Node]]:
    with ExitStack() as stack:
        one, other = Node(redis_url), Node(redis_url)  # which start at the same time
        stack.callback(one.close)
        stack.callback(other.close)
        yield one, other


@pytest.fixture
def nodes(redis_url: str) -> Iterator[tuple[Node, Node]]:
    """Two that the test may kill."""
    with two_nodes(redis_url) as nodes:
        yield nodes


@pytest.fixture(scope="module")
def lasting_nodes(redis_url: str) -> Iterator[tuple[Node, Node]]:
    with two_nodes(redis_url) as nodes:
        yield nodes


@pytest.mark.slow
def test_fleet_repeats_no_feedback_to_a_client_that_comes_back(
    nodes: tuple[Node, Node], tmp_path: Path
) -> None:
    async def test(at: str) -> list[str]:
        url = f"ws://{at}/ws?session=show&token=hidden"
        async with asyncio.timeout(LIMIT):
            async with connect(url) as client:
                await client.send(FIRST)
                await client.send(NEXT)
                first = await read_feedback(
                    client, "a:s:m"
                )  # the second block waits, the first one is in the middle
                owner, survivor = sorted(nodes, key=Node.sessions, reverse=True)
                assert (owner.sessions(), survivor.sessions()) == (1, 0)
                owner.kill()
                first += await read_feedback(client, "never")
            seen = seq_numbers(first)[-1]
            async with connect(f"{url}&seen={seen}") as client:  # the proxy has not found out yet
                rest = await read_feedback(client, "b:end")
            assert survivor.sessions() == 1
        return first + rest

    with (tmp_path / "proxy.log").open("w+") as log:
        with proxy(nodes, log) as at:
            feedback = asyncio.run(test(at))
        log.seek(0)
        written = log.read()
    seqs = seq_numbers(feedback)
    assert seqs == list(range(1, len(seqs) + 1))
    assert any('id="a:end"' in text for text in feedback)
    for text in feedback:
        parse_feedback(text)
    assert "GET /ws" in written
    assert "hidden" not in written


@pytest.mark.slow
def test_fleet_distributes_sessions_and_joins_their_clients(
    lasting_nodes: tuple[Node, Node], tmp_path: Path
) -> None:
    nodes, names = lasting_nodes, [f"show-{number}" for number in range(16)]
    before = [node.sessions() for node in nodes]

    async def test(at: str) -> None:
        async with asyncio.timeout(LIMIT), AsyncExitStack() as stack:
            clients = [
                await stack.enter_async_context(connect(f"ws://{at}/ws?session={name}"))
                for name in names + names
            ]
            counts = [node.sessions() - others for node, others in zip(nodes, before, strict=True)]
            assert sum(counts) == len(names)
            assert min(counts) > 0
            for client in clients:
                await client.send('{"type": "ping", "id": 1}')
                assert json.loads(await client.recv())["type"] == "pong"

    with (tmp_path / "proxy.log").open("w") as log, proxy(nodes, log) as at:
        asyncio.run(test(at))


@pytest.mark.slow
def test_fleet_limits_the_connections_of_an_address(lasting_nodes: tuple[Node, Node], tmp_path: Path) -> None:
    async def test(url: str) -> None:
        async with asyncio.timeout(LIMIT), connect(url), connect(url):
            with pytest.raises(InvalidStatus) as refused:
                await connect(url)
            assert refused.value.response.status_code == 429

    limit = {"REALIZER_MAX_CONNECTIONS": "2"}
    with (tmp_path / "proxy.log").open("w") as log, proxy(lasting_nodes, log, **limit) as at:
        asyncio.run(test(f"ws://{at}/ws?session=one"))


@pytest.mark.slow
def test_fleet_is_healthy_while_one_node_is(nodes: tuple[Node, Node], tmp_path: Path) -> None:
    services = yaml.safe_load(CONFIGURATION.with_name("compose.yaml").read_text("utf-8"))["services"]
    _, program, *options = services["proxy"]["healthcheck"]["test"]
    if shutil.which(program) is None:
        pytest.skip(f"{program} is not installed")
    with (tmp_path / "proxy.log").open("w") as log, proxy(nodes, log) as at:
        check = [program, *(word.replace("127.0.0.1:8765", at) for word in options)]
        assert any(at in word for word in check)
        nodes[0].kill()
        assert subprocess.run(check, check=False).returncode == 0
        nodes[1].kill()
        assert subprocess.run(check, check=False).returncode


@pytest.mark.slow
def test_fleet_hides_the_metrics_of_its_nodes(lasting_nodes: tuple[Node, Node], tmp_path: Path) -> None:
    with (tmp_path / "proxy.log").open("w") as log, proxy(lasting_nodes, log) as at:
        with urllib.request.urlopen(f"http://{at}/healthz") as answer:
            assert json.load(answer)["status"] == "ok"
        with pytest.raises(urllib.error.HTTPError, match="404") as refused:
            urllib.request.urlopen(f"http://{at}/metrics")
        refused.value.close()
