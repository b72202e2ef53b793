"""Several processes behind one port, each with its sessions."""

from __future__ import annotations

import asyncio
import contextlib
import json
import multiprocessing
import os
import signal
import socket
import subprocess
import sys
import threading
import urllib.error
import urllib.request
from collections.abc import Coroutine, Iterator
from typing import TypeVar

import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from realizer.core.settings import Settings
from realizer.server.runtime import worker_aggregation
from realizer.server.runtime.session_registry import worker_of
from realizer.server.runtime.workers import Workers
from realizer.server.serve import run_worker
from tests.ahead import viewed
from tests.programs import SERVE, running
from tests.waiting import LIMIT

pytestmark = pytest.mark.xdist_group("workers")

T = TypeVar("T")
NOD = '<bml id="{}"><head id="n" lexeme="NOD"/></bml>'


@pytest.fixture(scope="module")
def workers() -> Iterator[Workers]:
    """Two, in an event loop of their own."""
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever)
    thread.start()

    def wait(coroutine: Coroutine[None, None, T]) -> T:
        return asyncio.run_coroutine_threadsafe(coroutine, loop).result(LIMIT)

    there = wait(Workers(Settings(port=0, voice="silent", workers=2), run_worker).start())
    yield there
    wait(there.close())
    loop.call_soon_threadsafe(loop.stop)
    thread.join()
    loop.close()


def played(test: Coroutine[None, None, None]) -> None:
    """Run a client to its end."""

    async def run() -> None:
        async with asyncio.timeout(LIMIT):
            await test

    asyncio.run(run())


def address(workers: Workers) -> str:
    return f"ws://127.0.0.1:{workers.port}/ws"


def one_of(number: int) -> str:
    """The name of a session that a worker has."""
    return next(f"s{k}" for k in range(100) if worker_of(f"s{k}", 2, Settings()) == number)


async def message_with(client: ClientConnection, what: str) -> str:
    """The first text message that holds `what`."""
    async for message in client:
        if isinstance(message, str) and what in message:
            return message
    raise AssertionError(f"the connection ended before {what!r}")


def test_workers_bring_clients_of_a_session_together(workers: Workers) -> None:
    url = address(workers)

    async def test() -> None:
        for number in (0, 1):
            name = one_of(number)
            async with connect(f"{url}?session={name}") as sends, connect(f"{url}?session={name}") as looks:
                await sends.send(NOD.format(f"b{number}"))
                assert "blockProgress" in await message_with(looks, f'"b{number}:start"')

    played(test())


def test_workers_play_what_is_posted_to_a_session(workers: Workers) -> None:
    async def test() -> None:
        for number in (0, 1):
            name = one_of(number)
            posted = urllib.request.Request(
                f"http://127.0.0.1:{workers.port}/sessions/{name}/bml", NOD.format(f"p{number}").encode()
            )
            with await asyncio.to_thread(urllib.request.urlopen, posted) as answer:
                assert (answer.status, answer.headers["Connection"]) == (202, "close")
            async with connect(f"{address(workers)}?session={name}&seen=0") as looks:
                await message_with(looks, f'"p{number}:end"')

    played(test())


def test_workers_send_rows_ahead_and_take_them_back(workers: Workers) -> None:
    async def test() -> None:
        urls = [f"{address(workers)}?session={one_of(number)}" for number in (0, 1)]
        await asyncio.gather(*(viewed(url) for url in urls))

    played(test())


def test_workers_say_how_to_reach_a_session_of_another_worker(
    workers: Workers,
) -> None:
    url = address(workers)

    async def test() -> None:
        async with connect(f"{url}?session={one_of(0)}") as client:
            await client.send(json.dumps({"type": "hello", "version": 1, "session": one_of(1)}))
            error = json.loads(await message_with(client, '"error"'))
            assert f"/ws?session={one_of(1)}" in error["message"]
            await client.send(NOD.format("b"))  # and plays on
            await message_with(client, '"b:end"')

    played(test())


def test_workers_show_the_metrics_of_the_worker_that_is_named(workers: Workers) -> None:
    for number in (0, 1, 1, 0):
        address = f"http://127.0.0.1:{workers.port}/metrics?worker={number}"
        with urllib.request.urlopen(address, timeout=LIMIT) as answer:
            assert f'realizer_sessions{{worker="{number}"}}' in answer.read().decode()


def metrics(workers: Workers, query: str = "", headers: dict[str, str] | None = None) -> dict[str, float]:
    """Return name and labels -> value, of all workers or one of them."""
    address = f"http://127.0.0.1:{workers.port}/metrics{query}"
    with urllib.request.urlopen(urllib.request.Request(address, headers=headers or {}), timeout=LIMIT) as got:
        text = got.read().decode()
        assert len(text.encode()) == int(got.headers["Content-Length"])
    assert text.count("# TYPE realizer_sessions gauge") == 1
    return {
        line.rpartition(" ")[0]: float(line.rpartition(" ")[2])
        for line in text.splitlines()
        if not line.startswith("#")
    }


def test_workers_show_the_sum_of_all_metrics(workers: Workers) -> None:
    url = address(workers)

    async def test() -> None:
        names = [one_of(0), one_of(1)]
        async with contextlib.AsyncExitStack() as stack:
            clients = [await stack.enter_async_context(connect(f"{url}?session={name}")) for name in names]
            clients.append(await stack.enter_async_context(connect(f"{url}?session={names[1]}")))
            # One after the other, because two documents planned in one wake-up count as one.
            for number, client in enumerate(clients):
                await client.send(NOD.format(f"m{number}"))
                await message_with(client, f'"m{number}:start"')
            await until(workers, connections=3)
            each = [await asyncio.to_thread(metrics, workers, f"?worker={number}") for number in (0, 1)]
            whole = await asyncio.to_thread(metrics, workers)
        for name in ("realizer_sessions", "realizer_connections", "realizer_messages_total"):
            assert whole[name] == sum(each[k][f'{name}{{worker="{k}"}}'] for k in (0, 1))
        assert whole["realizer_connections"] == 3
        for number in (0, 1):
            mine = each[number][f'realizer_sessions{{worker="{number}"}}']
            assert whole[f'realizer_worker_sessions{{worker="{number}"}}'] == mine >= 1
        planned = [each[k][f'realizer_planning_seconds_bucket{{le="+Inf",worker="{k}"}}'] for k in (0, 1)]
        assert whole['realizer_planning_seconds_bucket{le="+Inf"}'] >= sum(planned) >= 3
        assert (
            whole["realizer_planning_seconds_count"] == whole['realizer_planning_seconds_bucket{le="+Inf"}']
        )

    played(test())


@pytest.mark.parametrize("named", ["9", "2", "x", "-1", "", "01"])
@pytest.mark.parametrize("path", ["metrics", "healthz"])
def test_workers_do_not_find_an_unknown_worker(workers: Workers, path: str, named: str) -> None:
    with pytest.raises(urllib.error.HTTPError, match="404") as missing:
        urllib.request.urlopen(f"http://127.0.0.1:{workers.port}/{path}?worker={named}", timeout=LIMIT)
    assert missing.value.read().decode() == f"worker: wanted a number of 0..1, got {named!r}\n"
    missing.value.close()


def health(workers: Workers, query: str = "") -> dict[str, object]:
    try:
        with urllib.request.urlopen(
            f"http://127.0.0.1:{workers.port}/healthz{query}", timeout=LIMIT
        ) as answer:
            answer_fields: dict[str, object] = json.loads(answer.read())
    except urllib.error.HTTPError as none:  # none of them has answered in time
        with none:
            return {}
    return answer_fields


async def until(workers: Workers, **wanted: object) -> dict[str, object]:
    """Wait until the health of all workers is as wanted; a busy machine keeps them waiting."""
    while not wanted.items() <= (answer_fields := await asyncio.to_thread(health, workers)).items():
        pass
    return answer_fields


def test_workers_report_the_health_of_all_while_one_hangs(workers: Workers) -> None:
    url = address(workers)

    async def test() -> None:
        names = [one_of(0), one_of(1)]
        async with contextlib.AsyncExitStack() as stack:
            for name in names:
                await stack.enter_async_context(connect(f"{url}?session={name}"))
            whole = await until(workers, status="ok", connections=2)
            assert whole["workers"] == 2
            each = [await asyncio.to_thread(health, workers, f"?worker={k}") for k in (0, 1)]
            assert [one["connections"] for one in each] == [1, 1]
            os.kill(workers._children[1][0].pid, signal.SIGSTOP)
            try:
                left = await until(workers, silent=[1])
            finally:
                os.kill(workers._children[1][0].pid, signal.SIGCONT)
            assert (left["status"], left["connections"]) == ("partly", 1)

    played(test())


def test_workers_leave_a_hanging_worker_out_of_the_sum(
    workers: Workers, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(worker_aggregation, "PATIENCE", 0.5)
    os.kill(workers._children[1][0].pid, signal.SIGSTOP)
    try:
        whole: dict[str, float] = {}
        while 'realizer_worker_sessions{worker="0"}' not in whole:  # a busy machine may keep it waiting too
            with contextlib.suppress(urllib.error.HTTPError):
                whole = metrics(workers)
            assert 'realizer_worker_sessions{worker="1"}' not in whole
    finally:
        os.kill(workers._children[1][0].pid, signal.SIGCONT)


@pytest.mark.slow
def test_workers_show_the_sum_only_with_the_token() -> None:
    async def test() -> None:
        there = await Workers(
            Settings(port=0, voice="silent", workers=2, token="Xk-secret-7"), run_worker
        ).start()
        try:
            with pytest.raises(urllib.error.HTTPError, match="401") as refused:
                await asyncio.to_thread(metrics, there)
            assert b"REALIZER_TOKEN" in refused.value.read()
            refused.value.close()
            for query, headers in (("?token=Xk-secret-7", {}), ("", {"Authorization": "Bearer Xk-secret-7"})):
                whole = await asyncio.to_thread(metrics, there, query, headers)
                assert whole['realizer_worker_sessions{worker="1"}'] == 0
            # Both workers have refused one.
            assert whole["realizer_refused_total"] == 2
        finally:
            await there.close()

    played(test())


@pytest.mark.slow
def test_workers_restart_one_that_was_killed_while_others_play(workers: Workers) -> None:
    url = address(workers)

    async def test() -> None:
        async with connect(f"{url}?session={one_of(0)}") as stays:
            async with connect(f"{url}?session={one_of(1)}") as client:
                await client.send(NOD.format("b"))
                await message_with(client, '"b:start"')
                killed = workers._children[1][0].pid
                os.kill(killed, signal.SIGKILL)
                with contextlib.suppress(ConnectionClosed):
                    await message_with(client, '"b:end"')
            while workers._children[1][0].pid == killed:
                await asyncio.sleep(0)
            await stays.send(NOD.format("c"))
            await message_with(stays, '"c:end"')
            async with connect(f"{url}?session={one_of(1)}", open_timeout=LIMIT) as client:
                await client.send(NOD.format("d"))
                await message_with(client, '"d:end"')

    played(test())


def test_workers_do_not_wait_for_clients_that_send_half_a_line(workers: Workers) -> None:
    url = address(workers)

    async def test() -> None:
        silent = [socket.create_connection(("127.0.0.1", workers.port)) for _ in range(20)]
        silent[0].sendall(b"GET /ws?sess")
        async with connect(url) as client:
            await client.send(NOD.format("b"))
            await message_with(client, '"b:start"')
        silent[0].sendall(b"ion=x HTTP/1.1\r\nHost: x\r\n\r\n")
        answer = await asyncio.to_thread(silent[0].recv, 4096)
        assert b" 426 " in answer
        for one in silent:
            one.close()

    played(test())


@pytest.mark.slow
def test_workers_of_the_command_log_with_their_number_drain_and_end() -> None:
    command = [sys.executable, "-m", "realizer", "-v", *SERVE[3:], "--workers", "2"]
    command += ["--token", "a-token-nobody-knows"]
    with running(command, stderr=subprocess.PIPE) as service:
        assert service.stdout is not None
        url = service.stdout.readline().split()[2]
        page = service.stdout.readline().split()[2]
        with urllib.request.urlopen(page + "healthz", timeout=LIMIT) as answer:
            assert json.loads(answer.read())["status"] == "ok"

        async def play() -> None:
            async with connect(f"{url}?token=a-token-nobody-knows") as client:
                await client.send(NOD.format("b"))
                await message_with(client, '"b:start"')
                service.send_signal(signal.SIGTERM)
                await message_with(client, '"b:end"')

        with pytest.raises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(page + "metrics?worker=1", timeout=LIMIT)
        refused.value.close()
        played(play())
        _, logged = service.communicate(timeout=LIMIT)
        assert service.returncode == 0
    assert any(line.startswith("realizer: worker 1: ") and "token" in line for line in logged.splitlines())


@pytest.mark.slow
def test_workers_that_hang_do_not_keep_the_service_from_ending(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr("realizer.server.runtime.workers.GRACE", 0.2)

    async def test() -> None:
        others = set(multiprocessing.active_children())
        service = await Workers(Settings(port=0, voice="silent", workers=2, drain=0.0), run_worker).start()
        started = set(multiprocessing.active_children()) - others
        children = sorted(child.pid for child in started if child.pid is not None)
        os.kill(children[1], signal.SIGSTOP)
        await service.close()
        for child in children:
            with pytest.raises(ProcessLookupError):
                os.kill(child, 0)

    played(test())
    assert "worker 1 does not end: it is killed" in caplog.text


@pytest.mark.slow
def test_workers_report_what_is_missing_once_without_a_traceback() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        command = [*SERVE, "--workers", "2", "--xface-port", str(taken.getsockname()[1])]
        done = subprocess.run(command, capture_output=True, text=True, timeout=LIMIT)
    assert done.returncode == 3
    (line,) = done.stderr.splitlines()
    assert "address already in use" in line


def test_workers_report_an_address_in_use_before_they_start() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken, pytest.raises(OSError, match="in use"):
        asyncio.run(Workers(Settings(port=taken.getsockname()[1], workers=2), run_worker).start())
