"""The base of TCP transports, with the smallest transport that echoes."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from realizer.server.runtime.session_registry import SESSION_ID
from realizer.server.transports import tcp_listener
from realizer.server.transports.tcp_listener import TcpTransport, session_name
from tests.waiting import LIMIT, wait_for


class Echo(TcpTransport):
    """A transport that repeats lines, and fails at `fail`."""

    @property
    def startup_lines(self) -> tuple[str, ...]:
        return (self.address,)

    async def _handle(self, host: str, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        while line := await reader.readline():
            if line == b"fail\n":
                raise ZeroDivisionError
            writer.write(line)


def opened(
    test: Callable[[Echo], Awaitable[None]],
    host: str = "127.0.0.1",
    most: int = 2,
    allow: tuple[str, ...] = (),
) -> None:
    async def run() -> None:
        transport = Echo("echo", host, 0, most, allow)
        await transport.start()
        await transport.ready()
        try:
            async with asyncio.timeout(LIMIT):
                await test(transport)
        finally:
            await transport.close()
            while OPEN:
                OPEN.pop().close()

    asyncio.run(run())


OPEN: list[asyncio.StreamWriter] = []  # of the running test


async def dial(transport: Echo) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    reader, writer = await asyncio.open_connection("127.0.0.1", transport.port)
    OPEN.append(writer)
    return reader, writer


async def line_of(transport: Echo, line: bytes) -> tuple[bytes, asyncio.StreamReader, asyncio.StreamWriter]:
    """The answer to a line, b"" if the connection is closed or reset, and the streams."""
    reader, writer = await dial(transport)
    writer.write(line)
    try:
        return await reader.readline(), reader, writer
    except ConnectionResetError:
        return b"", reader, writer


@given(st.sampled_from(["asap", "xface"]), st.ip_addresses().map(str) | st.text(max_size=200))
def test_session_name_is_a_valid_name_of_a_session(transport: str, host: str) -> None:
    name = session_name(transport, host)
    assert SESSION_ID.fullmatch(name)
    assert name.startswith(f"{transport}-")


@pytest.mark.parametrize(("host", "address"), [("127.0.0.1", "127.0.0.1:{}"), ("::1", "[::1]:{}")])
def test_tcp_transport_has_its_open_port_in_the_address(host: str, address: str) -> None:
    async def test(transport: Echo) -> None:
        assert transport.port > 0
        assert transport.startup_lines == (address.format(transport.port),)

    try:
        opened(test, host)
    except OSError:
        pytest.skip(f"no {host} on this machine")


def test_tcp_transport_counts_its_clients() -> None:
    async def test(transport: Echo) -> None:
        got, _, writer = await line_of(transport, b"here\n")
        assert got == b"here\n"
        assert len(transport) == 1
        writer.close()
        await wait_for(lambda: len(transport) == 0)

    opened(test)


def test_tcp_transport_limits_the_connections_of_an_address(caplog: pytest.LogCaptureFixture) -> None:
    async def test(transport: Echo) -> None:
        first, second = [await line_of(transport, b"x\n") for _ in range(2)]
        assert (await line_of(transport, b"x\n"))[0] == b""
        assert not second[2].is_closing()
        first[2].close()
        await wait_for(lambda: len(transport) == 1)
        assert (await line_of(transport, b"x\n"))[0] == b"x\n"

    with caplog.at_level(logging.WARNING):
        opened(test)
    assert "echo: 127.0.0.1 is refused: 2 connections from it are open" in caplog.text


@pytest.mark.parametrize(
    ("allow", "got"), [("127.0.0.0/8", b"x\n"), ("2001:db8::/32", b""), ("192.0.2.1", b"")]
)
def test_tcp_transport_accepts_the_allowed_addresses_only(
    allow: str, got: bytes, caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch
) -> None:
    async def test(transport: Echo) -> None:
        assert (await line_of(transport, b"x\n"))[0] == b"x\n"  # this machine is always allowed
        monkeypatch.setattr(tcp_listener, "is_loopback", lambda host: False)
        assert (await line_of(transport, b"x\n"))[0] == got

    with caplog.at_level(logging.WARNING):
        opened(test, allow=(allow,))
    assert ("echo: 127.0.0.1 is refused: REALIZER_ALLOW does not name it" in caplog.text) == (got == b"")


def test_tcp_transport_logs_an_error_and_ends_that_connection_only(caplog: pytest.LogCaptureFixture) -> None:
    async def test(transport: Echo) -> None:
        stays = await line_of(transport, b"x\n")
        assert (await line_of(transport, b"fail\n"))[0] == b""
        await wait_for(lambda: len(transport) == 1)
        assert not stays[2].is_closing()

    with caplog.at_level(logging.ERROR):
        opened(test)
    assert "echo: 127.0.0.1 is disconnected: its connection failed" in caplog.text


def test_tcp_transport_stop_accepting_keeps_clients_until_it_closes() -> None:
    async def test(transport: Echo) -> None:
        reader, writer = await dial(transport)
        writer.write(b"one\n")
        assert await reader.readline() == b"one\n"
        transport.stop_accepting()
        with pytest.raises(ConnectionRefusedError):
            await asyncio.open_connection("127.0.0.1", transport.port)
        writer.write(b"two\n")
        assert await reader.readline() == b"two\n"
        await transport.close()
        assert len(transport) == 0

    opened(test)
