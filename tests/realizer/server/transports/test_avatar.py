"""Which session an avatar shows, and that nothing depends on its program."""

from __future__ import annotations

import asyncio
import json
import struct
import urllib.request

from realizer.core.settings import Settings
from realizer.server.serve import Server
from tests.realizer.server.transports.udp_receiver import LIMIT, Receiver, answered, opened, sending


def jaw(packet: bytes) -> float:
    """The weight of jawOpen in a packet of Live Link, whose 61 values are at its end."""
    return float(struct.unpack(">61f", packet[-244:])[17])


def set_jaw(value: int) -> str:
    return json.dumps({"type": "set", "faps": {"open_jaw": value}})


async def health(server: Server) -> dict[str, object]:
    def get() -> bytes:
        with urllib.request.urlopen(f"{server.page}healthz") as reply:
            return bytes(reply.read())

    return dict(json.loads(await asyncio.to_thread(get)))


def test_avatar_shows_the_oldest_session_that_has_a_client() -> None:
    async def test(server: Server, receiver: Receiver) -> None:
        async with opened(server, None) as first, opened(server, "second") as second:
            await answered(first, set_jaw(0))
            await answered(second, set_jaw(500))
            await receiver.until(lambda: len(receiver.packets) > 3)
            assert {jaw(packet) for packet in receiver.packets} == {0}
            await first.close()
            await receiver.until(lambda: jaw(receiver.packets[-1]) > 0.1)

    sending("livelink", test)


def test_avatar_does_not_keep_a_session_open() -> None:
    async def test(server: Server, receiver: Receiver) -> None:
        async with opened(server, None):
            await receiver.until(lambda: bool(receiver.packets))
        while (await health(server))["connections"]:
            pass
        assert (await health(server))["sessions"] == 0

    sending("livelink", test, vmc="127.0.0.1:9")


def test_avatar_shows_the_session_that_the_setting_names() -> None:
    async def test(server: Server, receiver: Receiver) -> None:
        async with opened(server, None) as other, opened(server, "stage") as stage:
            await answered(other, set_jaw(0))
            await answered(stage, set_jaw(500))
            await receiver.until(lambda: bool(receiver.packets) and jaw(receiver.packets[-1]) > 0.1)

    sending("livelink", test, avatar_session="stage")


def test_avatar_joins_its_session_again_when_it_was_ended() -> None:
    async def test(server: Server, receiver: Receiver) -> None:
        await receiver.until(lambda: bool(receiver.packets))
        assert server._sessions.end("stage")
        receiver.packets.clear()
        await receiver.until(lambda: bool(receiver.packets))

    sending("livelink", test, avatar_session="stage")


def test_avatar_that_nobody_receives_disturbs_no_client() -> None:
    async def run() -> None:
        nowhere = Settings(port=0, vmc="127.0.0.1:9", livelink="nowhere.invalid:11111", voice="silent")
        async with asyncio.timeout(LIMIT), Server(nowhere) as server, opened(server, None) as client:
            await client.send('{"type":"subscribe","stream":"fap","encoding":"json"}')
            frames = 0
            while frames < 20:
                frames += '"fap"' in str(await client.recv())
            await answered(client, set_jaw(10))

    asyncio.run(run())
