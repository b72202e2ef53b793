"""Recordings of a real service, compared with the frames and feedback of its clients."""

from __future__ import annotations

import asyncio
import contextlib
import json
import re
import resource
import sqlite3
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from websockets.asyncio.client import ClientConnection, connect

from realizer.animation.fap.fap_reader import read_fap
from realizer.cli import cli
from realizer.core.settings import Settings
from realizer.server.journal.recordings import read_recording
from realizer.server.journal.session_journal import ENTRIES
from realizer.server.serve import Server
from realizer_studio.recorded_sessions import replay_feedback
from tests.feedback_log import read_feedback, seq_numbers
from tests.programs import serving
from tests.waiting import LIMIT

TALK = """<bml id="talk"><speech id="s"><text>This is cut off in the middle of what is said</text></speech>
<faceShift id="f" start="0.2"><faceLexeme id="l" lexeme="SMILE" amount="0.5"/></faceShift>
<head id="h" lexeme="SHAKE" start="0.1" end="3"/></bml>"""
OTHER = """<bml id="other" composition="REPLACE" xmlns:bmla="http://www.asap-project.org/bmla">
<faceLexeme id="f" lexeme="RAISE_BROWS" end="4"/>
<bmla:parametervaluechange id="p" target="other:f" paramId="amount" start="0.2" end="0.5">
<bmla:trajectory type="linear" targetValue="0.2"/></bmla:parametervaluechange></bml>"""
NOD = '<bml id="{}"><head id="n" lexeme="NOD" end="0.5"/></bml>'


def setting(**what: Any) -> str:
    return json.dumps({"type": "set", **what})


async def watched(client: ClientConnection, frames: dict[int, list[int]], many: int) -> None:
    """Take in so many frames more."""
    wanted = len(frames) + many
    async for message in client:
        if isinstance(message, str) and message.startswith('{"type":"fap"'):
            frame = json.loads(message)
            frames[frame["frame"]] = frame["values"]
            if len(frames) == wanted:
                return


def written(record: Path) -> list[list[int]]:
    """The FAPs of a replay, as its file has them."""
    out = record.with_suffix(".fap")
    done = CliRunner().invoke(cli, ["replay", str(record), "-o", str(out)])
    assert done.exit_code == 0, done.output
    values: list[list[int]] = read_fap(out.read_text()).values.tolist()
    return values


@pytest.mark.slow
def test_recorded_frames_are_those_of_a_live_viewer(tmp_path: Path) -> None:
    live: dict[int, list[int]] = {}
    doings = [
        setting(aus={"1": 0.8, "12L": 0.4}),
        setting(aus={"1": 0.2}, faps={"open_jaw": 120}),
        TALK,
        setting(emotion={"type": "anger", "intensity": 0.6}, aus={"12L": None}),
        setting(faps={"open_jaw": -40}),
        OTHER,
        setting(emotion=None),
        setting(aus=None),
        '{"type": "stop"}',
        setting(aus={"4": 1}),
        setting(aus=None, faps=None),
    ]

    async def watch() -> None:
        settings = Settings(port=0, voice="silent", record=tmp_path)
        async with (
            asyncio.timeout(LIMIT),
            Server(settings) as server,
            connect(f"{server.url}?session=seen", max_queue=None) as client,
        ):
            await client.send('{"type": "subscribe", "stream": "fap", "encoding": "json"}')
            for many, doing in enumerate(doings, 5):
                await watched(client, live, many)
                await client.send(doing)
            await watched(client, live, 2)

    asyncio.run(watch())
    (path,) = tmp_path.iterdir()
    assert [text for text in replay_feedback(read_recording(path)) if "warning" in text] == []
    again = written(path)
    assert len(live) > 100
    assert {frame: again[frame] for frame in live if frame < len(again)} == live
    assert len(again) - max(live) > 2, "what is let go of fades, though nobody looks any more"
    held = np.array(list(live.values()))
    assert len({tuple(row) for row in held[:, 2:].tolist()}) > 60


async def until(url: str, last: str, *messages: str) -> list[str]:
    """Send, and return the feedback up to a progress."""
    async with asyncio.timeout(LIMIT), connect(url, max_queue=None) as client:
        for message in messages:
            await client.send(message)
        return await read_feedback(client, last)


@pytest.mark.slow
def test_recorded_session_is_whole_after_a_takeover(tmp_path: Path) -> None:
    records, options = tmp_path / "r", ("--journal", str(tmp_path / "j"), "--record", str(tmp_path / "r"))
    with serving(*options) as (url, service):
        first = asyncio.run(until(f"{url}?session=s", "talk:start", setting(aus={"4": 1}), TALK))
        service.kill()
    (path,) = records.iterdir()
    with path.open("a") as broken:
        broken.write('{"at": 1.2, "ki')
    with serving(*options) as (url, _):
        seen = seq_numbers(first)[-1]
        rest = asyncio.run(until(f"{url}?session=s&seen={seen}", "two:end", NOD.format("two")))
    assert list(records.iterdir()) == [path]
    assert replay_feedback(read_recording(path))[: len(first + rest)] == first + rest


@pytest.mark.slow
def test_recorded_session_begins_anew_where_its_file_is_missing(tmp_path: Path) -> None:
    journal = tmp_path / "journal.db"

    def checked() -> bool:
        with contextlib.closing(sqlite3.connect(journal)) as file:
            return file.execute("SELECT 1 FROM parts").fetchone() is not None

    async def play() -> tuple[list[str], list[str]]:
        def settings(folder: str) -> Settings:
            return Settings(port=0, voice="silent", journal=str(journal), record=tmp_path / folder)

        async with asyncio.timeout(LIMIT):
            async with Server(settings("here")) as server, connect(f"{server.url}?session=s") as client:
                await client.send(setting(aus={"4": 1}))
                await client.send(NOD.format("one"))
                first = await read_feedback(client, "one:end")
                for _ in range(ENTRIES):
                    await client.send('{"type": "scene", "objects": null}')
                while not checked():
                    await client.send('{"type": "ping"}')
                    await client.recv()
                await client.send(TALK)
                first += await read_feedback(client, "talk:start")
            async with Server(settings("there")) as server:
                url = f"{server.url}?session=s&seen={seq_numbers(first)[-1]}"
                return first, await until(url, "two:end", NOD.format("two"))

    first, rest = asyncio.run(play())
    (path,) = (tmp_path / "there").iterdir()
    record = read_recording(path)
    assert "state" in record.parts
    again = replay_feedback(record)
    begins = seq_numbers(again)[0]
    assert 1 < begins <= len(first)
    assert again[: len(first + rest) - begins + 1] == (first + rest)[begins - 1 :]
    faps = written(path)
    assert all(row[30] < -50 for row in faps[:5]), "the brow is held down from the first frame on"


@pytest.mark.slow
def test_recorded_sessions_of_two_workers_have_one_file_each(tmp_path: Path) -> None:
    async def play(url: str) -> dict[str, list[str]]:
        names = [f"s{k}" for k in range(6)]
        got = await asyncio.gather(
            *(until(f"{url}?session={name}", "b:end", NOD.format("b")) for name in names)
        )
        return dict(zip(names, got, strict=True))

    with serving("--workers", "2", "--record", str(tmp_path)) as (url, _):
        live = asyncio.run(play(url))
    assert len(list(tmp_path.iterdir())) == len(live)
    for name, texts in live.items():
        (path,) = tmp_path.glob(f"{name}-*.jsonl")
        assert replay_feedback(read_recording(path)) == texts


def test_recorded_session_can_be_replayed_after_a_full_disk(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")  # the limit would cut compiled modules, too
    large = f'<bml id="large"><head id="n" lexeme="NOD" end="0.4"/><!-- {"x" * 5000} --></bml>'

    async def play(url: str) -> tuple[list[str], str]:
        first = await until(f"{url}?session=s", "b:end", NOD.format("b"))
        rest = await until(f"{url}?session=s", "c:end", large, NOD.format("c"))
        return first + rest, await counted(url)

    async def counted(url: str) -> str:
        host, port = re.match(r"ws://(.*):(\d+)/", url).groups()  # type: ignore[union-attr]
        reader, writer = await asyncio.open_connection(host, int(port))
        writer.write(b"GET /metrics HTTP/1.1\r\nHost: x\r\nConnection: close\r\n\r\n")
        text = (await reader.read()).decode()
        writer.close()
        return text

    _, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    with serving("--record", str(tmp_path)) as (url, service):
        resource.prlimit(service.pid, resource.RLIMIT_FSIZE, (4000, hard))
        live, metrics = asyncio.run(play(url))
    assert any('id="c:end"' in text for text in live)
    assert "realizer_records_stopped_total 1" in metrics
    (path,) = tmp_path.iterdir()
    again = replay_feedback(read_recording(path))
    assert again == live[: len(again)]
    assert any('id="b:end"' in text for text in again)
