"""The Xface transport on loopback, with both published clients rebuilt from their known bytes."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import Awaitable, Callable
from pathlib import Path

import pytest
from websockets.asyncio.client import connect

from realizer.core.settings import Settings
from realizer.server.serve import Server
from realizer.server.transports.xface import server as xface
from realizer.server.transports.xface.server import XfaceTransport
from tests.waiting import LIMIT

MASK = " ".join("1" if fap in (3, 48) else "0" for fap in range(1, 69))
# The pattern that the second client waits for, letter by letter.
GREETING = re.compile(
    rb'<notify name="CONNECTION_OK" ownerId="([0-9]+)" taskId="[0-9]+" status="[0-9]+"/>.*', re.S
)
ERROR = ("ERROR", 0, 0, 7)
SCRIPT = '<bml id="{}"><wait id="w" duration="0.05"/></bml>'


def fap(frames: int, value: int = 500, name: str = "x", fps: int = 25) -> str:
    lines = [f"2.1 {name} {fps} {frames}"]
    for number in range(frames):
        lines += [MASK, f"{number} {value} {number}"]
    return "\n".join(lines) + "\n"


def task(name: str, owner: int, id: int, *params: str, end: str = "\0") -> str:
    inner = "".join(f"\n<param>{param}</param>" for param in params)
    return f'<task name="{name}" ownerId="{owner}" taskId="{id}">{inner}\n</task>{end}'


class Client:
    """Reads as clients of the player do, at most 4000 bytes at a time; notes end with NULs."""

    def __init__(self, port: int) -> None:
        self.port = port
        self.raw = b""
        self.owner = 0

    async def __aenter__(self) -> Client:
        self.reader, self.writer = await asyncio.open_connection("127.0.0.1", self.port)
        await self.until(lambda: GREETING.match(self.raw) is not None)
        found = GREETING.match(self.raw)
        assert found is not None
        self.owner = int(found[1])
        return self

    async def __aexit__(self, *_: object) -> None:
        self.writer.transport.abort()

    def send(self, text: str | bytes) -> None:
        self.writer.write(text.encode() if isinstance(text, str) else text)

    async def until(self, there: Callable[[], bool]) -> None:
        while not there():
            data = await self.reader.read(4000)
            assert data, self.raw
            self.raw += data

    @property
    def notes(self) -> list[tuple[str, int, int, int]]:
        """Name, owner, task and status of all notes but the greeting."""
        found = re.findall(
            r'<notify name="(\w+)" ownerId="(\d+)" taskId="(\d+)" status="(\d)"/>\0\0', self.text
        )
        return [(name, *map(int, numbers)) for name, *numbers in found[1:]]

    @property
    def text(self) -> str:
        return self.raw.decode()

    async def statuses(self, id: int, last: int = 3) -> list[int]:
        """Return all statuses of a task, once `last` has arrived."""
        await self.until(lambda: any(note[2:] == (id, last) for note in self.notes))
        return [status for _, _, number, status in self.notes if number == id]


def serving(test: Callable[[Server, XfaceTransport], Awaitable[None]], **settings: object) -> None:
    async def run() -> None:
        chosen = Settings(port=0, xface_port=0, idle=False, voice="silent", **settings)  # type: ignore[arg-type]
        async with asyncio.timeout(LIMIT), Server(chosen) as server:
            transport = next(
                transport for transport in server.transports if isinstance(transport, XfaceTransport)
            )
            await test(server, transport)

    asyncio.run(run())


def test_xface_prints_its_address() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        assert transport.startup_lines == (
            f"xface: tasks at 127.0.0.1:{transport.port}, session xface-ADDRESS",
        )

    serving(test)


def test_xface_sends_the_literal_greeting_that_clients_compare() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as first, Client(transport.port) as second:
            wanted = b'<notify name="CONNECTION_OK" ownerId="1" taskId="0" status="0"/>\0\0'
            assert first.raw == wanted
            assert second.raw == wanted.replace(b'ownerId="1"', b'ownerId="2"')

    serving(test)


def note(name: bytes, id: int, *statuses: int) -> bytes:
    parts = (b'<notify name="%b" ownerId="1" taskId="%d" status="%d"/>\0\0' % (name, id, s) for s in statuses)
    return b"".join(parts)


async def exchange(port: int, talk: list[tuple[bytes, bytes]]) -> None:
    """Send the bytes of a client, and read exactly the expected answer before going on."""
    reader, writer = await asyncio.open_connection("127.0.0.1", port)
    for said, wanted in talk:
        for byte in said:
            writer.write(bytes([byte]))
            await writer.drain()
        assert await reader.readexactly(len(wanted)) == wanted
    writer.write_eof()
    assert await reader.read() == b"", "nothing more was said"
    writer.close()


JAW = MASK.encode()


def test_xface_serves_the_player_s_own_client_byte_by_byte() -> None:
    """It ends tasks with one NUL, numbers them from a million for each client, and waits for 3 or 7."""
    upload = (
        b'<task name="UPLOAD_FAP" ownerId="1" taskId="1000001">\n<param>2.1 x 25 2\n%b\n0 5 0\n%b\n1 9 1\n'
    )
    talk = [
        (b"", b'<notify name="CONNECTION_OK" ownerId="1" taskId="0" status="0"/>\0\0'),
        (upload % (JAW, JAW) + b"</param>\n</task>\0", note(b"UPLOAD_FAP", 1000001, 1, 2, 3)),
        (
            b'<task name="RESUME_PLAYBACK" ownerId="1" taskId="1000002">\n</task>\0',
            note(b"RESUME_PLAYBACK", 1000002, 1, 2, 3),
        ),
        (
            b'<task name="STOP_PLAYBACK" ownerId="1" taskId="1000003">\n</task>\0',
            note(b"STOP_PLAYBACK", 1000003, 1, 3),
        ),
        (
            b'<task name="RENDER_FRAME" ownerId="1" taskId="1000004">\n</task>\0',
            note(b"RENDER_FRAME", 1000004, 1),
        ),
        (
            b'<task name="DANCE" ownerId="1" taskId="1000005">\n</task>\0',
            note(b"ERROR", 1000005, 7),
        ),
        (b'<task name="KILL_APP" ownerId="1" taskId="1000006">\n</task>\0', note(b"KILL_APP", 1000006, 3)),
    ]

    async def test(server: Server, transport: XfaceTransport) -> None:
        await exchange(transport.port, talk)

    serving(test)


def test_xface_serves_the_streaming_client_byte_by_byte() -> None:
    """It ends tasks with nothing, writes a status into them, and stops so that the frame is shown."""
    upload = (
        b'<task name="UPLOAD_FAP" ownerId="1" taskId="%d"><param>2.1 C:\\Users\\me\\TempFile 25 1\n '
        b"%b\n 0 %d 40 \n</param></task>"
    )
    stop = b'<task name="STOP_PLAYBACK" ownerId="1" taskId="%d" status="0"></task>'
    talk = [(b"", b'<notify name="CONNECTION_OK" ownerId="1" taskId="0" status="0"/>\0\0')]
    for id in range(1, 9, 2):
        talk.append((upload % (id, JAW, 100 * id), note(b"UPLOAD_FAP", id, 1, 2, 3)))
        talk.append((stop % (id + 1), note(b"STOP_PLAYBACK", id + 1, 1, 3)))

    async def test(server: Server, transport: XfaceTransport) -> None:
        await exchange(transport.port, talk)

    serving(test)


def test_xface_uploads_plays_and_stops_for_the_player_s_own_client() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:
            client.send(task("UPLOAD_FAP", client.owner, 1000001, fap(1000)))
            assert await client.statuses(1000001) == [1, 2, 3]
            client.send(task("RESUME_PLAYBACK", client.owner, 1000002))
            assert await client.statuses(1000002, last=2) == [1, 2]
            client.send(task("STOP_PLAYBACK", client.owner, 1000003))
            assert await client.statuses(1000003) == [1, 3]
            assert await client.statuses(1000002) == [1, 2, 3]
            assert {note[:2] for note in client.notes if note[2] == 1000002} == {("RESUME_PLAYBACK", 1)}

    serving(test)


def test_xface_finishes_playback_when_the_file_ends() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:
            client.send(task("UPLOAD_FAP", 1, 1, fap(5)) + task("RESUME_PLAYBACK", 1, 2))
            assert await client.statuses(2) == [1, 2, 3]

    serving(test)


async def face(server: Server, wanted: Callable[[list[int]], bool], after: Callable[[], None]) -> None:
    """Wait until the face of the clients' session is as wanted; `after` is done once frames come."""
    async with connect(f"{server.url}?session=xface-127.0.0.1") as viewer:
        await viewer.send('{"type":"subscribe","stream":"fap","encoding":"json"}')
        assert '"subscribed"' in str(await viewer.recv())
        after()
        async for message in viewer:
            if str(message).startswith("{") and wanted(json.loads(message).get("values", [0] * 68)):
                return


def test_xface_moves_the_face_for_the_streaming_client_without_nuls() -> None:
    """Its files have one frame, a fixed Windows path for a name, and no FAP that is 0."""

    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:

            def send(value: int, id: int) -> None:
                mask = MASK.replace("1", "0", 0) if value else " ".join("0" * 68)
                row = f"0 {value} 40 " if value else "0 "
                text = f"2.1 C:\\Users\\me\\Temp\\TempFile 25 1\n {mask}\n {row}\n"
                client.send(
                    f'<task name="UPLOAD_FAP" ownerId="{client.owner}" taskId="{id}">'
                    f"<param>{text}</param></task>"
                )
                head = f'<task name="STOP_PLAYBACK" ownerId="{client.owner}" taskId="{id + 1}"'
                client.send(head + ' status="0"></task>')

            await face(server, lambda values: values[2] == 700 and values[47] == 40, lambda: send(700, 1))
            await face(server, lambda values: values[2] == 0, lambda: send(0, 3))
            assert await client.statuses(3) == [1, 2, 3]
            assert await client.statuses(4) == [1, 3]

    serving(test)


def test_xface_shows_a_frame_of_the_next_client_alone() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as first:
            await face(
                server,
                lambda values: values[2] == 300,
                lambda: first.send(task("UPLOAD_FAP", 1, 1, fap(1, 300))),
            )
        head = fap(1).replace(MASK, " ".join("1" if n == 48 else "0" for n in range(1, 69)))
        async with Client(transport.port) as second:
            await face(
                server,
                lambda values: values[2] == 0 and values[47] == 9,
                lambda: second.send(task("UPLOAD_FAP", 2, 1, head.replace("0 500 0", "0 9"))),
            )

    serving(test)


def test_xface_shows_a_file_to_viewers() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:

            def play() -> None:
                client.send(task("UPLOAD_FAP", 1, 1, fap(50)) + task("RESUME_PLAYBACK", 1, 2))

            await face(server, lambda values: values[2] == 500, play)

    serving(test)


@pytest.mark.parametrize("end", ["", "\0", "\0\0", "\n\0", "\r\n"])
@pytest.mark.parametrize("cut", [1, 7, 100, 10_000])
def test_xface_reads_tasks_cut_anywhere_with_any_end(end: str, cut: int) -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:
            data = "".join(task("UPLOAD_FAP", 1, id, fap(2), end=end) for id in (1, 2, 3)).encode()
            for begin in range(0, len(data), cut):
                client.send(data[begin : begin + cut])
                await client.writer.drain()
            assert await client.statuses(3) == [1, 2, 3]
            assert [note[2] for note in client.notes if note[3] == 3] == [1, 2, 3]

    serving(test)


def test_xface_starts_and_finishes_a_script_with_its_blocks() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:
            script = SCRIPT.format("a") + SCRIPT.format("b").replace(" id=", ' composition="APPEND" id=', 1)
            client.send(task("UPLOAD_SCRIPT", 1, 9, script, "BML"))
            assert await client.statuses(9) == [1, 2, 3]

    serving(test)


def test_xface_finishes_each_script_of_a_dialect_without_ids() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:
            for id in (9, 10):
                client.send(task("UPLOAD_SCRIPT", 1, id, '<act><bml><head type="NOD"/></bml></act>', "BML"))
                assert await client.statuses(id) == [1, 2, 3]

    serving(test)


def test_xface_ends_a_script_at_a_stop() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:
            client.send(
                task("UPLOAD_SCRIPT", 1, 9, '<bml id="a"><wait id="w" duration="1000"/></bml>', "BML")
            )
            assert await client.statuses(9, last=2) == [1, 2]
            client.send(task("STOP_PLAYBACK", 1, 10))
            assert await client.statuses(10) == [1, 3]
            assert await client.statuses(9) == [1, 2, 3]
            client.send(
                task(
                    "UPLOAD_SCRIPT",
                    1,
                    11,
                    SCRIPT.format("b").replace(" id=", ' composition="APPEND" id=', 1),
                    "BML",
                )
            )
            assert await client.statuses(11) == [1, 2, 3], "nothing is left to wait for"

    serving(test)


@pytest.mark.parametrize(
    ("params", "statuses"),
    [
        (("<bml", "BML"), [1, 7]),
        (("<bml id='a'><required><head id='h' lexeme='NO'/></required></bml>", "BML"), [1, 7]),
        ((SCRIPT.format("a"), "SMIL-Agent"), [1, 7]),
        (("", "BML"), [1, 7]),
        ((), [1, 7]),
    ],
)
def test_xface_reports_a_script_that_cannot_be_played(params: tuple[str, ...], statuses: list[int]) -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:
            client.send(task("UPLOAD_SCRIPT", 1, 9, *params))
            assert await client.statuses(9, last=7) == statuses

    serving(test)


def test_xface_reports_a_bad_file_and_finishes_as_clients_expect() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:
            client.send(task("UPLOAD_FAP", 1, 1, "hello world"))
            assert await client.statuses(1) == [1, 7, 3]
            client.send(task("UPLOAD_FAP", 1, 2, ""))
            assert await client.statuses(2, last=7) == [1, 7]
            client.send(task("RESUME_PLAYBACK", 1, 3))
            assert await client.statuses(3, last=7) == [1, 7]

    serving(test)


def test_xface_loads_files_of_the_media_folder(tmp_path: Path) -> None:
    (tmp_path / "clip.fap").write_text(fap(3))

    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:
            client.send(task("LOAD_FAP", 1, 1, "C:\\faps\\clip.fap"))
            assert await client.statuses(1) == [1, 2, 3]
            client.send(task("LOAD_FAP", 1, 2, "../../etc/passwd"))
            assert await client.statuses(2) == [1, 7, 3]

    serving(test, media=tmp_path)


def test_xface_reports_a_file_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "clip.fap").write_text(fap(3))

    def unreadable(path: Path) -> bytes:
        raise PermissionError(13, "Permission denied", str(path))

    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:
            monkeypatch.setattr(Path, "read_bytes", unreadable)
            client.send(task("LOAD_FAP", 1, 1, "clip.fap") + task("STOP_PLAYBACK", 1, 2))
            assert await client.statuses(1) == [1, 7, 3]
            assert await client.statuses(2) == [1, 3]

    serving(test, media=tmp_path)


def test_xface_sends_no_notes_to_owner_0() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:
            client.send(task("UPLOAD_FAP", 0, 1, fap(2)) + task("UPLOAD_FAP", 1, 2, fap(2)))
            await client.statuses(2)
            assert {note[2] for note in client.notes} == {2}

    serving(test)


def test_xface_kill_app_ends_the_client_and_not_the_service() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client, Client(transport.port) as other:
            client.send(task("KILL_APP", 1, 1))
            assert await client.statuses(1) == [3]
            assert await client.reader.read() == b""
            other.send(task("STOP_PLAYBACK", 2, 2))
            assert await other.statuses(2) == [1, 3]

    serving(test)


READ = ("ERROR", 1, 5, 7)
# Bytes, and the note that answers them, with the ids that could be read.
BAD = {
    "rubbish": (b"hello\0", ERROR),
    "binary": (bytes(range(1, 256)) + b"\0", ERROR),
    "half a tag": (b'<task name="STOP_PLAYBACK" ownerId="1" taskId="5"\0', ERROR),
    "half a task": (b'<task name="UPLOAD_FAP" ownerId="1" taskId="5"><param>2.1\0', ("UPLOAD_FAP", 1, 5, 7)),
    "a task in a task": (b'<task name="DANCE" ownerId="1" taskId="5"><param>2.1', READ),
    "no name": (b'<task ownerId="1" taskId="5"></task>\0', READ),
    "no name of one": (b'<task name="a b" ownerId="1" taskId="5"></task>\0', READ),
    "no ids": (b'<task name="DANCE" ownerId="x"></task>\0', ERROR),
    "an unknown task": (b'<task name="DANCE" ownerId="1" taskId="5"></task>\0', READ),
    "another element": (b"<notify/>\0", ERROR),
    "a task that never begins": (b"<task " + b"x" * 5000 + b"\0", ERROR),
}


@pytest.mark.parametrize(("data", "note"), BAD.values(), ids=BAD)
def test_xface_reports_one_error_and_reads_the_next_task(
    data: bytes, note: tuple[str, int, int, int]
) -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:
            client.send(data + task("STOP_PLAYBACK", 1, 9).encode())
            assert await client.statuses(9) == [1, 3]
            assert client.notes[0] == note
            assert len(client.notes) == 3

    serving(test)


def test_xface_refuses_a_task_that_is_too_large(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    assert xface.MAX_TASK == 4 * 2**20, "docs/protocol.md and docs/limits.md say so"
    monkeypatch.setattr(xface, "MAX_TASK", 100_000)

    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client, Client(transport.port) as other:
            client.send(task("UPLOAD_FAP", 1, 5, "9 " * 500_000))
            other.send(task("UPLOAD_FAP", 2, 6, fap(3)))
            assert await other.statuses(6) == [1, 2, 3]
            client.send(task("STOP_PLAYBACK", 1, 9))
            assert await client.statuses(9) == [1, 3]
            assert [note for note in client.notes if note[2] != 9] == [("UPLOAD_FAP", 1, 5, 7)]

    serving(test)


def test_xface_loads_a_million_bytes_of_frames() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:
            client.send(task("UPLOAD_FAP", 1, 5, fap(7000)))
            assert await client.statuses(5) == [1, 2, 3]

    serving(test)


@pytest.mark.slow
def test_xface_accepts_a_thousand_connections_one_after_the_other() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as other:
            for _ in range(1000):
                async with Client(transport.port):
                    pass
            other.send(task("STOP_PLAYBACK", 1, 2))
            assert await other.statuses(2) == [1, 3]

    serving(test)


def test_xface_refuses_connections_beyond_the_limit_at_once() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as one:
            pairs = [await asyncio.open_connection("127.0.0.1", transport.port) for _ in range(300)]
            first = [await reader.readuntil(b"\0\0") for reader, _ in pairs]
            refused = b'<notify name="ERROR" ownerId="0" taskId="0" status="7"/>\0\0'
            assert sum(answer == refused for answer in first) == 300 - (xface.MAX_CLIENTS - 1)
            one.send(task("UPLOAD_FAP", 1, 2, fap(3)))
            assert await one.statuses(2) == [1, 2, 3]
            for _, writer in pairs:
                writer.transport.abort()

    serving(test)


def test_xface_limits_the_number_of_clients(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(xface, "MAX_CLIENTS", 2)

    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as one, Client(transport.port):
            reader, writer = await asyncio.open_connection("127.0.0.1", transport.port)
            assert await reader.read() == b'<notify name="ERROR" ownerId="0" taskId="0" status="7"/>\0\0'
            writer.close()
            one.send(task("STOP_PLAYBACK", 1, 2))
            assert await one.statuses(2) == [1, 3]

    serving(test)


def test_xface_reads_a_flood_slowly_and_loses_nothing(
    all_at_once,
    caplog: pytest.LogCaptureFixture,
) -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:
            for id in range(1, 9):
                client.send(task("UPLOAD_FAP", client.owner, id, fap(1)))
            assert await client.statuses(8) == [1, 2, 3]
        assert caplog.text.count("REALIZER_MAX_RATE") == 1

    serving(test, max_rate=3)


def test_xface_limits_the_connections_of_an_address() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client:
            reader, writer = await asyncio.open_connection("127.0.0.1", transport.port)
            assert await reader.read() == b""
            writer.transport.abort()
            client.send(task("UPLOAD_FAP", client.owner, 1, fap(1)))
            assert await client.statuses(1) == [1, 2, 3]

    serving(test, max_connections=1)


def test_xface_stops_reading_a_client_that_never_reads() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as deaf, Client(transport.port) as other:
            deaf.reader._transport.pause_reading()  # type: ignore[attr-defined]
            for _ in range(200):
                deaf.send(task("RENDER_FRAME", 1, 5) * 500)
            other.send(task("UPLOAD_FAP", 2, 6, fap(3)))
            assert await other.statuses(6) == [1, 2, 3]

    serving(test)


def test_xface_skips_sound_files_and_waits_for_half_of_one() -> None:
    async def test(server: Server, transport: XfaceTransport) -> None:
        async with Client(transport.port) as client, Client(transport.port) as half:
            half.send(task("UPLOAD_WAV", 2, 1, "a.wav", "1000") + "RIFF")
            client.send(task("UPLOAD_WAV", 1, 1, "a.wav", "1000"))
            assert await client.statuses(1, last=7) == [1, 7]
            client.send(b"RIFF" + b"<task>" * 166)
            client.send(task("STOP_PLAYBACK", 1, 2))
            assert await client.statuses(2) == [1, 3]
            assert ERROR not in client.notes

    serving(test)
