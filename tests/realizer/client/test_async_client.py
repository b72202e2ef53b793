"""The asynchronous client against the real service: sending, waiting, iterating, errors."""

from __future__ import annotations

import asyncio
from typing import Any

import numpy as np
import pytest

from bml_schema.feedback import WarningFeedback
from realizer.client import ClientError, connect
from realizer.face.load import load_face
from realizer.protocol.wire import (
    MeshFrame,
    WireFrame,
)
from tests.realizer.client.service import WAIT, serving


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
            assert [f async for f in client.until_end("b")][-1].seq == end.seq
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


def test_client_play_of_an_id_in_use_by_another_client_is_refused() -> None:
    async def test(url: str) -> None:
        async with connect(f"{url}?session=s") as one, connect(f"{url}?session=s") as other:
            ends = await asyncio.gather(
                *(client.play(WAIT.format("b")) for client in (one, other)), return_exceptions=True
            )
            played, refused = sorted(ends, key=lambda end: isinstance(end, ClientError))
            assert played.status == "DONE"
            assert isinstance(refused, ClientError)

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
                await asyncio.sleep(0.1)
                layers = (await client.state())["characters"][0]["layers"]
            assert layers["direct"]["aus"].keys() == {"12L"}

    serving(test)


def test_client_keeps_errors_apart_from_answers() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            for send in (client.control, client.ask):
                with pytest.raises(ClientError, match=r"set\.aus\.12: "):
                    await send("set", aus={"12": 7})
                with pytest.raises(ClientError, match='got "stopp"'):
                    await send("stopp")
                with pytest.raises(ClientError, match=r"ping\.x"):
                    await send("ping", x=1)
                assert (await client.ask("ping", id=1))["id"] == 1
            assert await client.ask("stop") == {}
            both = await asyncio.gather(
                client.control("stopp"), client.ask("ping", id=2), client.ask("state"), return_exceptions=True
            )
            assert [type(both[0]).__name__, both[1]["id"], both[2]["type"]] == ["ClientError", 2, "state"]
            assert client.errors == []

    serving(test)


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
