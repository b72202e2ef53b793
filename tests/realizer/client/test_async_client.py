"""The asynchronous client against the real service: sending, waiting, iterating, errors."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from typing import Any

import numpy as np
import pytest

from bml_schema.feedback import WarningFeedback
from realizer.client import Client, ClientError, connect
from realizer.core.settings import Settings
from realizer.face.load import load_face
from realizer.protocol.wire import (
    ArkitFrame,
    AUFrame,
    FapFrame,
    MeshFrame,
    PictureFrame,
    SoundFrame,
    WireFrame,
)
from realizer.server.serve import Server
from tests.realizer.client.service import LIMIT, WAIT, serving


def test_client_follows_a_block_to_its_end() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            await client.send(WAIT.format("b"))
            ids = [getattr(f, "id", None) async for f in client.until_end()]
            assert [i for i in ids if i] == ["b:start", "b:w:start", "b:w:end", "b:end"]
            await client.send(WAIT.format("c"))
            assert [f async for f in client.until_end("c")][-1].id == "c:end"

    serving(test)


def test_client_until_end_stops_at_a_refusal() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            await client.send('<bml id="b"><required><head id="n" lexeme="NONE"/></required></bml>')
            assert isinstance([f async for f in client.until_end()][-1], WarningFeedback)
            await client.send("<bml id='x'><oops")
            assert isinstance([f async for f in client.until_end()][-1], WarningFeedback)

    serving(test)


def test_client_schedules_do_not_mix_with_answers() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            await client.subscribe("schedule")
            await client.send(WAIT.format("b"))
            states = []
            async for message in client.frames("schedule"):
                assert isinstance(message, dict)
                states += [block["state"] for block in message["blocks"]]
                if "DONE" in states:
                    break
            assert states[0] != "DONE"
            assert (await client.ask("ping"))["type"] == "pong"

    serving(test)


def test_client_has_no_frames_of_an_unknown_stream() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            with pytest.raises(ValueError, match=r"wanted one of fap, au, .*; got 'fapp'"):
                client.frames("fapp")

    serving(test)


def test_client_keeps_the_frames_of_two_streams_apart() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            subscribed = await client.subscribe("fap", fps=50)
            await client.subscribe("au", fps=50, encoding="json")
            assert len(subscribed["names"]) == 68
            numbers = []
            async for frame in client.frames("fap"):
                assert isinstance(frame, WireFrame)
                numbers.append(frame.frame)
                if len(numbers) == 5:
                    break
            assert numbers == list(range(subscribed["frame"], subscribed["frame"] + 5))
            async for frame in client.frames("au"):
                assert frame["type"] == "au"
                break

    serving(test)


@pytest.mark.parametrize("ahead", [0, 0.2])
def test_client_yields_frames_without_those_taken_back(ahead: float) -> None:
    async def test(url: str) -> None:
        async with connect(url) as client, connect(f"{url}?session={client.session}") as other:
            await other.subscribe("fap")
            numbers, rows = [], {}
            async for frame in client.faps(ahead=ahead, fps=25):
                numbers.append(frame.frame)
                rows[frame.frame] = frame.values.tolist()
                if len(numbers) == 3:
                    await client.send('<bml id="b"><head id="n" lexeme="NOD"/></bml>')
                if len(numbers) == 30:
                    break
            assert numbers == list(range(numbers[0], numbers[0] + 30))
            timely = {}
            async for frame in other.frames("fap"):
                assert isinstance(frame, WireFrame)
                timely[frame.frame] = frame.values.tolist()
                if frame.frame == numbers[-1]:
                    break
            # Frames that were due when the document was planned may have been yielded before it.
            differ = [k for k in numbers if k in timely and rows[k] != timely[k]]
            assert len(differ) <= 2
            assert (await client.ask("ping"))["type"] == "pong"

    serving(test)


def test_client_refuses_frames_too_far_ahead() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            with pytest.raises(ClientError, match="ahead"):
                await anext(client.aus(ahead=3))
            frame = await anext(client.aus(ahead=0.5))
            assert frame.stream == "au"
            assert (await anext(client.arkit())).values.shape == (59,)

    serving(test)


def test_client_raises_an_error_of_the_service() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            with pytest.raises(ClientError, match="wanted a stream of"):
                await client.subscribe("smell")
            assert (await client.ask("ping"))["type"] == "pong"

    serving(test)


def test_client_play_returns_the_end_of_the_block() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            end = await client.play(WAIT.format("b"))
            assert (end.id, end.status) == ("b:end", "DONE")
            # Whoever iterates gets the feedback all the same.
            assert [f async for f in client.until_end("b")][-1] == end
            ends = await asyncio.gather(client.play(WAIT.format("c")), client.play(WAIT.format("d")))
            assert [end.id for end in ends] == ["c:end", "d:end"]
            with pytest.raises(ClientError, match="lexeme") as caught:
                await client.play('<bml id="e"><required><head id="n" lexeme="NONE"/></required></bml>')
            assert caught.value.code == "refused"

    serving(test)


@pytest.mark.parametrize("nothing", ["", " \n", "<!-- later -->", '<?xml version="1.0"?>'])
def test_client_play_refuses_a_blank_text_at_once(nothing: str) -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            with pytest.raises(ClientError, match="wanted <bml>, got nothing"):
                await client.play(nothing)

    serving(test)


@pytest.mark.parametrize(
    "document",
    [
        "<bml xmlns='http://www.bml-initiative.org/bml/bml-2.0' id='b'/>",
        "<bml id='a:b'/>",
        "<bml id='bml'/>",
        f"<bml id='{'x' * 300}'/>",
        "<bml id='b'/><bml id='c'",
        "<bml id='b'/><bml id='b'/>",
        f"<bml id='b'/><bml id='c'/>{' ' * (1 << 20)}",
        ' {"type":"foo"}',
    ],
)
def test_client_play_raises_for_every_refused_document(document: str) -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            with pytest.raises(ClientError) as caught:
                await client.play(document)
            assert caught.value.code == "refused"

    serving(test)


@pytest.mark.parametrize(
    ("document", "block"),
    [
        ("<bml><head type='NOD'/></bml>", "unnamed1"),
        ("<act><participant id='x'/><bml><head type='NOD'/></bml></act>", "unnamed1"),
        ("<bml id=' b '/>", "b"),
        ("<bml id='b'><bml id='c'/></bml>", "b"),
        ("<bml id='b'><speech id='s'><text><![CDATA[<bml id='z'/>]]></text></speech></bml>", "b"),
    ],
)
def test_client_play_follows_the_block_that_the_service_plays(document: str, block: str) -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            assert (await client.play(document)).id == f"{block}:end"
            await client.send(document.replace("'b'", "'b2'"))
            assert [feedback async for feedback in client.until_end()][-1] == client._router.last_sent.last

    serving(test)


def test_client_play_of_an_id_in_use_leaves_the_older_block_alone() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            first, second = await asyncio.gather(
                *(client.play(WAIT.format("b")) for _ in range(2)), return_exceptions=True
            )
            assert first.status == "DONE"
            assert isinstance(second, ClientError)
            assert "still in use" in str(second)

    serving(test)


def test_client_until_end_needs_something_to_wait_for() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            with pytest.raises(ValueError, match="no BML was sent"):
                await anext(client.until_end())
            await client.send(WAIT.format("b"))
            assert [f async for f in client.until_end()][-1].id == "b:end"
            assert [f async for f in client.until_end()] == []

    serving(test)


def test_client_has_the_welcome_and_the_state() -> None:
    async def test(url: str) -> None:
        async with connect(f"{url}?session=show") as client:
            assert (client.session, client.welcome["version"]) == ("show", 1)
            assert "NOD" in client.welcome["capabilities"]["lexemes"]["head"]
            await client.control("set", aus={"12L": 0.5})
            layers: dict[str, Any] = {}
            while "direct" not in layers:  # it is reached smoothly
                layers = (await client.state())["characters"][0]["layers"]
            assert layers["direct"]["aus"].keys() == {"12L"}

    serving(test)


def test_client_keeps_errors_apart_from_answers() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            await client.control("set", aus={"12": 7})
            assert (await client.ask("ping", id=1))["id"] == 1
            assert [error["where"] for error in client.errors] == ["set.aus.12"]
            with pytest.raises(ValueError, match="which are answered; got stop"):
                await client.ask("stop")

    serving(test)


def iterations(client: Client) -> list[AsyncIterator[Any]]:
    methods = client.feedback, client.aus, client.faps, client.mesh, client.sound
    return [client.until_end("b"), client.frames("fap"), *(method() for method in methods)]


async def rest(items: AsyncIterator[Any]) -> list[Any]:
    return [item async for item in items]


def test_client_iterations_end_when_it_is_closed() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            tasks = [asyncio.create_task(rest(items)) for items in iterations(client)]
            await client.ask("ping")
            await client.close()
            await asyncio.gather(*tasks)
            assert await rest(client.feedback()) == []
            with pytest.raises(ClientError, match="has ended: it was closed here"):
                await client.wait_for(lambda: False)

    serving(test)


def test_client_iterations_raise_when_the_connection_is_lost() -> None:
    async def run() -> None:
        settings = Settings(port=0, voice="silent")
        async with asyncio.timeout(LIMIT), Server(settings) as server, connect(server.url) as client:
            tasks = [asyncio.create_task(rest(items)) for items in iterations(client)]
            await client.ask("ping")
            await server.close()
            for result in await asyncio.gather(*tasks, return_exceptions=True):
                assert isinstance(result, ClientError)
                assert str(result) == "the connection has ended: the service ends"

    asyncio.run(run())


@pytest.mark.parametrize(
    "say",
    [
        lambda client: client.send(WAIT.format("b")),
        lambda client: client.play(WAIT.format("b")),
        lambda client: client.control("stop"),
        lambda client: client.ask("ping"),
        lambda client: client.subscribe("fap"),
    ],
)
def test_client_raises_its_own_error_after_the_end_of_the_connection(say: Any) -> None:
    async def run() -> None:
        settings = Settings(port=0, voice="silent")
        async with asyncio.timeout(LIMIT), Server(settings) as server, connect(server.url) as client:
            await server.close()
            with pytest.raises(ClientError, match="the connection has ended: the service ends") as caught:
                await say(client)
            assert caught.value.code == "connection"

    asyncio.run(run())


def test_client_raises_to_all_that_wait_if_a_message_is_unreadable() -> None:
    class Socket:
        is_open = True

        async def recv(self) -> bytes:
            return b"no frame"

        async def close(self) -> None:
            self.is_open = False

    async def run() -> None:
        client = Client(socket := Socket(), "", connect)
        waits = client.frames("fap"), client.feedback(), client.until_end("b")
        tasks = [asyncio.ensure_future(anext(wait)) for wait in waits]
        for result in await asyncio.gather(*tasks, return_exceptions=True):
            assert isinstance(result, ClientError)
            assert "cannot be read: WireError('wanted a header of 16 bytes" in str(result)
        assert not socket.is_open
        await client.close()

    asyncio.run(asyncio.wait_for(run(), LIMIT))


def test_client_reads_a_mesh_by_the_present_face() -> None:
    async def test(url: str) -> None:
        rests = {face: load_face(face) for face in ("ada", "ben")}
        async with connect(url) as client:
            await client.control("character", face="ada")
            await client.subscribe("fap")
            subscribed = await client.subscribe("mesh", fps=50)
            assert subscribed["face"] == "ada"
            numbers, shown = [], []
            async for frame in client.frames("mesh"):
                assert isinstance(frame, MeshFrame)
                assert frame.stream_info is not None
                numbers.append(frame.frame)
                shown.append(frame.stream_info["face"])
                # A face moves by centimetres; by another one's scale it would be another face.
                assert np.abs(frame.vertices - rests[shown[-1]].vertices).max() < 0.03
                if shown == ["ada"] * 3:
                    await client.control("character", face="ben")
                if shown[-3:] == ["ben"] * 3:
                    break
            assert frame.stream_info["type"] == "changed"
            assert frame.stream_info["frame"] == frame.frame - 2
            assert numbers == list(range(subscribed["frame"], subscribed["frame"] + len(numbers)))
            assert not client.errors

    serving(test)


@pytest.mark.parametrize(
    ("method", "kind", "shape", "dtype"),
    [
        ("faps", FapFrame, (68,), np.int32),
        ("aus", AUFrame, None, np.float32),
        ("arkit", ArkitFrame, (59,), np.float32),
        ("mesh", MeshFrame, None, np.int16),
        ("sound", SoundFrame, (441,), np.int16),
    ],
)
def test_client_has_a_method_for_each_stream_with_frames_of_its_type(
    method: str, kind: type[WireFrame[Any]], shape: tuple[int, ...] | None, dtype: type
) -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            frames = getattr(client, method)()
            first = asyncio.create_task(anext(frames))
            await client.ask("ping")
            if method == "sound":
                await client.say(np.full(8000, 500, np.int16), 8000)
            frame = await first
            assert type(frame) is kind
            assert frame.values.dtype == dtype
            assert shape in (None, frame.values.shape)
            if method in ("faps", "aus", "arkit"):
                assert len(frame.named) == len(frame.values)
            await frames.aclose()
            assert (await client.ask("ping"))["type"] == "pong"
            assert not client.errors

    serving(test)


@pytest.mark.gl
def test_client_yields_pictures() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            async for picture in client.pictures(fps=5, size=(64, 48), format="png"):
                assert type(picture) is PictureFrame
                assert picture.pixels.shape[:2] == (48, 64)
                break

    serving(test, limit=60)


def test_client_raises_when_a_stream_is_refused() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            for frames in (client.mesh(fps=-1), client.sound(rate=7), client.faps(ahead=9)):
                with pytest.raises(ClientError, match="wanted"):
                    await anext(frames)

    serving(test)


def test_client_has_streams_of_two_characters_side_by_side() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            for name in ("ada", "ben"):
                await client.control("character", id=name, face=name)
            meshes = [client.mesh(character=name) for name in ("ada", "ben")]
            frames = [await anext(mesh) for mesh in meshes for _ in range(2)]
            assert [frame.stream_info["face"] for frame in frames if frame.stream_info] == ["ada"] * 2 + [
                "ben"
            ] * 2

    serving(test)
