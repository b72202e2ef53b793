"""WebSocket connections: admission, logs, frames and the end."""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import re
from pathlib import Path

import pytest
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from realizer.core.settings import Settings
from realizer.server.http.connections import session_of
from realizer.server.journal import JournalError
from realizer.server.runtime.session_registry import JoinError
from realizer.server.serve import Server
from tests.waiting import LIMIT

TOKEN = "a-token-of-many-letters-and-0123456789"


def closed(url: str, *messages: str, **settings: object) -> tuple[list[str], int, str]:
    """Return the answers to a client whose first messages are these, and the code and reason of the close."""

    async def run() -> tuple[list[str], int, str]:
        received: list[str] = []
        here = Settings(port=0, voice="silent", **settings)  # type: ignore[arg-type]
        async with asyncio.timeout(LIMIT), Server(here) as server, connect(server.url + url) as client:
            for message in messages:
                await client.send(message)
            with contextlib.suppress(ConnectionClosed):
                while True:
                    received.append(str(await client.recv()))
        return received, client.close_code or 0, client.close_reason or ""

    return asyncio.run(run())


def test_connection_says_what_it_wanted_before_a_token() -> None:
    (error,), code, reason = closed("?session=s", '{"type": "ping"}', token=TOKEN)
    assert (json.loads(error)["code"], json.loads(error)["where"]) == ("token", "hello.token")
    assert code == 1008
    assert reason.startswith("token: wanted")


def test_connection_asks_to_come_again_if_a_session_cannot_be_read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken(self: object, session: str) -> None:
        raise JournalError("the disk does not answer")

    monkeypatch.setattr("realizer.server.journal.sqlite_journal.SqliteJournal.claim", broken)
    received, code, reason = closed("?session=s", journal=str(tmp_path / "journal.db"))
    assert (received, code, reason) == ([], 1013, "the disk does not answer")


def test_connection_logs_its_begin_and_end(caplog: pytest.LogCaptureFixture) -> None:
    async def run() -> None:
        here = Settings(port=0, voice="silent")
        async with (
            asyncio.timeout(LIMIT),
            Server(here) as server,
            connect(f"{server.url}?session=show") as client,
        ):
            await client.send('{"type": "ping"}')
            await client.recv()
            await client.close()

    with caplog.at_level(logging.INFO, "realizer.server.http.connections"):
        asyncio.run(run())
    joined, left = (r for r in caplog.records if r.name == "realizer.server.http.connections")
    assert (joined.message, left.message) == ("joined", "left")
    assert (joined.session, joined.address) == ("show", "127.0.0.1")  # type: ignore[attr-defined]
    assert (left.session, left.code) == ("show", 1000)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("query", "session", "seen"),
    [
        ("", None, None),
        ("?session=show", "show", None),
        ("?session=show&seen=0", "show", 0),
        ("?session=a&session=b&seen=1&seen=12", "b", 12),
        ("?session=", None, None),
        ("?token=x&session=a%20b", "a b", None),
    ],
)
def test_session_of_reads_the_address(query: str, session: str | None, seen: int | None) -> None:
    assert session_of(f"/ws{query}") == (session, seen)


@pytest.mark.parametrize("seen", ["", "abc", "-1", "1.5", "9" * 16])
def test_session_of_refuses_a_bad_number_in_seen(seen: str) -> None:
    with pytest.raises(JoinError, match="seen: wanted the number of the last feedback that came") as refused:
        session_of(f"/ws?session=show&seen={seen}")
    assert refused.value.status == 400


def test_session_of_refuses_a_misspelt_parameter() -> None:
    text = "the address has an unknown parameter 'seesion', did you mean session?"
    with pytest.raises(JoinError, match=re.escape(text)) as refused:
        session_of("/ws?seesion=show")
    assert refused.value.status == 400
    assert session_of("/ws?session=show&nocache=7") == ("show", None)
