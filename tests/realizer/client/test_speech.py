"""Streaming speech from the client's side, against the real service."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from bml_schema.feedback import BlockProgress, SyncPointProgress, WarningFeedback
from realizer.client import ClientError, connect
from realizer.client.block_waiters import BlockWaiters
from realizer.client.speech import Speech, SpeechProgress
from realizer.core.settings import Settings
from realizer.server.serve import Server
from tests.realizer.client.service import LIMIT, serving


def test_speech_waits_for_syncs_and_the_end() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            async with client.speech("s1") as speech:
                for token in ("Yes, ", '<sync id="a"/>', "here. ", 'And <sync id="b"/>there'):
                    await speech.append(token)
                await client.send('<bml id="n"><head id="n" lexeme="NOD" start="s1:s1:b"/></bml>')
                first = await speech.until("a")
            second = await speech.until("b")
            assert 0 < first < second
            end = await speech.ended()
            assert second < end.global_time
            assert (end.status, end.said) == ("DONE", None)
            progress = {f.id: f async for f in client.until_end("s1") if isinstance(f, SyncPointProgress)}
            assert progress["n:n:start"].global_time == pytest.approx(second)

    serving(test)


def test_speech_sends_quick_tokens_together_and_a_stop_at_once() -> None:
    async def test() -> None:
        sent: list[tuple[str, dict[str, object]]] = []

        async def control(type: str, **fields: object) -> None:
            sent.append((type, fields))

        async def wait(_: object) -> None: ...

        def check() -> None: ...

        speech = Speech("s1", {"language": "nl"}, control, wait, check)
        for token in ("One ", *["two "] * 5000):
            await speech.append(token)
        assert [fields["append"] for _, fields in sent] == ["One "]
        while len(sent) < 2:
            await asyncio.sleep(0)
        await speech.append("three")
        await speech.close()
        await speech.close()
        await asyncio.sleep(0)
        assert asyncio.all_tasks() == {asyncio.current_task()}, "none outlives the loop"
        with pytest.raises(ClientError, match="the speech s1 was closed"):
            await speech.append("four")
        assert sent[0][1]["language"] == "nl"
        assert (
            "".join(str(fields.get("append", "")) for _, fields in sent) == "One " + "two " * 5000 + "three"
        )
        assert [bool(fields.get("close")) for _, fields in sent] == [False, False, False, True]

        stopped = Speech("s2", {}, control, wait, check)
        sent.clear()
        await stopped.append("One. ")
        await stopped.append("Two. ")
        await stopped.stop()
        await stopped.close()
        assert [type for type, _ in sent] == ["speech", "stop", "speech"]

    asyncio.run(test())


def test_speech_that_is_stopped_says_what_was_spoken() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            async with client.speech("s1", composition="MERGE") as speech:
                await speech.append('One two. <sync id="m"/>Three four five six seven eight nine ten. Eleven')
                await speech.until("m")
                await speech.stop()
            end = await speech.ended()
            assert end.status == "INTERRUPTED"
            assert (end.said or "").startswith("One two")
            with pytest.raises(ClientError, match="without a sync 'x'"):
                await speech.until("x")

    serving(test)


@pytest.mark.parametrize("how", ["speech", "at once", "client"])
def test_speech_may_have_the_id_of_one_that_was_stopped(how: str) -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            first = client.speech("s1")
            await first.append('A long story <sync id="m"/>about a town. ')
            await first.until("m")
            await (client.control("stop") if how == "client" else first.stop())
            if how != "at once":
                assert (await first.ended()).status == "INTERRUPTED"
            await first.append("It is ignored. ")
            async with client.speech("s1") as second:
                await second.append("Hello.")
            assert (await second.ended()).status == "DONE"
            assert (await first.ended()).status == "INTERRUPTED"
            await first.close()  # changes nothing any more
            assert not client.errors

    serving(test)


def test_speech_closed_with_its_connection_refuses_text_of_the_next_one() -> None:
    async def test(url: str) -> None:
        async with connect(f"{url}?session=show") as client:
            lost = client.speech("s1")
            speech = await lost.__aenter__()
            await speech.append("One two three four five six seven eight nine ten. " * 9)
            await client.ask("ping")
            await client.close()  # while appended text waits a moment for more
            with pytest.raises(ClientError, match="the connection has ended"):
                await speech.append("Eleven. ")
        async with connect(f"{url}?session=show&seen=0") as client:
            while (await client.state())["connections"] > 1:
                pass  # the service has not seen the other one go
            async with client.speech("s1") as again:
                await again.append("Eleven. ")
                with pytest.raises(ClientError, match="'s1' is closed and being spoken") as caught:
                    await again.ended()
                assert caught.value.code == "invalid"
                with pytest.raises(ClientError, match="'s1' is closed and being spoken"):
                    await again.append("Twelve. ")
            async with client.speech("s2") as other:
                await other.append("One.")
            assert (await other.ended()).status == "DONE"

    serving(test, real_time=True)


def test_speech_restored_in_another_process_refuses_more_text_too(tmp_path: Path) -> None:
    settings = Settings(port=0, voice="silent", journal=str(tmp_path / "journal.db"))

    async def run() -> None:
        async with (
            asyncio.timeout(LIMIT),
            Server(settings) as one,
            Server(settings) as other,
            connect(f"{one.url}?session=show") as client,
        ):
            lost = client.speech("s1")
            speech = await lost.__aenter__()
            await speech.append("One two three four five six seven eight nine ten. ")
            await client.ask("ping")
            async with connect(f"{other.url}?session=show&seen=0") as survivor:
                async with survivor.speech("s1") as again:
                    await again.append("Eleven. ")
                    with pytest.raises(ClientError, match="'s1' is closed and being spoken"):
                        await again.ended()
                end = [f async for f in survivor.until_end("s1")][-1]
                assert isinstance(end, BlockProgress)
                assert end.status == "DONE", "what had come is said to its end"

    asyncio.run(run())


def test_speech_is_stopped_by_an_exception_and_frees_its_id() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            speeches = []

            async def broken() -> None:
                async with client.speech("s1") as speech:
                    speeches.append(speech)
                    await speech.append("One two three four five six seven eight. ")
                    raise ZeroDivisionError

            with pytest.raises(ZeroDivisionError):
                await broken()
            assert (await speeches[0].ended()).status in ("INTERRUPTED", "REVOKED")
            async with client.speech("s1") as again:
                await again.append("One.")
            assert (await again.ended()).status == "DONE"

    serving(test)


def test_speech_with_the_id_of_a_playing_block_is_refused() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            await client.send('<bml id="s1"><wait id="w" duration="60"/></bml>')
            async with client.speech("s1") as speech:
                await speech.append("One. ")
            with pytest.raises(ClientError, match="still in use"):
                await speech.ended()

    serving(test)


def test_speech_raises_if_the_connection_ends_before_a_sync() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:

            async def left() -> None:
                async with client.speech("s1") as speech:
                    await speech.append("One. ")
                    waiting = asyncio.create_task(speech.until("never"))
                    await client.close()
                    await waiting

            with pytest.raises(ClientError, match="connection has ended"):
                await left()

    serving(test)


def test_speech_of_the_sync_client_does_the_same() -> None:
    def plain(url: str) -> None:
        with connect(url) as client:
            with client.speech("s1") as speech:
                speech.append('One <sync id="a"/>two. ')
                assert speech.until("a") > 0
                speech.append("Three. ")
            assert speech.ended().status == "DONE"
            with client.speech("s2") as cut:
                cut.append("One two three four five six seven eight. ")
                cut.stop()
            assert cut.ended().status in ("INTERRUPTED", "REVOKED")

            def broken() -> None:
                with client.speech("s3") as third:
                    third.append("One two three four five six seven eight. ")
                    raise ZeroDivisionError

            with pytest.raises(ZeroDivisionError):
                broken()
            assert [getattr(f, "id", "") for f in client.until_end("s3")][-1] == "s3:end"
            with client.speech("s4") as fourth:
                fourth.append("One. ")
                fourth.close()
                with pytest.raises(ClientError, match="s4 was closed"):
                    fourth.append("Two. ")

    async def test(url: str) -> None:
        await asyncio.to_thread(plain, url)

    serving(test, real_time=True)


def test_speech_appends_a_text_of_any_length() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            async with client.speech("s1") as speech:
                await speech.append("<!-- -->" + " " * 30_000 + 'One <sync id="m"/>two.')
                await speech.append("")
            assert await speech.until("m") > 0
            assert (await client.ask("ping"))["type"] == "pong", "no error waits"

    serving(test)


def test_speech_progress_ignores_feedback_of_other_blocks() -> None:
    heard = SpeechProgress("s")
    waiters = BlockWaiters(heard)
    for id in ("t.1:t:m", "s.1:n:m", "s:s:m", "s.1:s:stroke:2"):
        waiters.on_feedback(SyncPointProgress(id=id, time=0.0, global_time=1.0))
    waiters.on_feedback(BlockProgress(id="s.1:end", global_time=1.0))
    waiters.on_feedback(WarningFeedback(id="s.1", type="X", text="no"))
    assert heard.points == {"stroke:2": 1.0}
    assert not heard.is_finished


def test_speech_with_the_id_of_one_being_spoken_leaves_that_alone() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            unused = client.speech("turn")
            async with client.speech("turn") as first:
                await first.append("One two three four.")
            async with client.speech("turn") as second:
                await second.append("Five.")
            with pytest.raises(ClientError, match="'turn' is closed and being spoken"):
                await second.ended()
            with pytest.raises(ClientError, match="still in use"):
                await client.play('<bml id="turn"><wait id="w" duration="0.1"/></bml>')
            assert (await first.ended()).status == "DONE"
            async with unused:
                await unused.append("Six.")
            assert (await unused.ended()).global_time > (await first.ended()).global_time

    serving(test, real_time=True)


def test_speech_with_the_id_of_an_open_one_continues_that() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            first = client.speech("turn")
            await first.append("One. ")
            async with client.speech("turn") as second:
                await second.append('Two <sync id="m"/>three.')
            assert await second.until("m") > 0
            assert await second.ended() == await first.ended()

    serving(test)


def test_speak_reads_a_text_as_people_mean_it_and_returns_its_end() -> None:
    async def test(url: str) -> None:
        async with connect(url) as client:
            end = await client.speak("**Well** [nod] it costs $5.", id="s")
            assert (end.id, end.status) == ("s:end", "DONE")
            done = await client.speak("*Hi*", plain=True)
            assert done.status == "DONE"

    serving(test)
