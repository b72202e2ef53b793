"""The examples of other voices, against servers that speak the voices' published protocols."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import json
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from websockets.asyncio.client import connect as open_socket
from websockets.asyncio.server import ServerConnection
from websockets.asyncio.server import serve as serve_sockets

from realizer.client import Client, connect
from realizer.core.settings import Settings
from realizer.protocol.wire import unpack_clip
from realizer.server.serve import Server
from tests.waiting import LIMIT

EXAMPLES = Path(__file__).parents[2] / "examples"


def example(name: str) -> ModuleType:
    spec = spec_from_file_location(name, EXAMPLES / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules[name] = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


elevenlabs, realtime = example("elevenlabs_voice"), example("realtime_voice")


def tone(seconds: float, rate: int) -> bytes:
    return (9000 * np.sin(np.arange(round(seconds * rate)) * 0.1)).astype("<i2").tobytes()


@asynccontextmanager
async def voice_server(answer: Any) -> AsyncIterator[str]:
    async with serve_sockets(answer, "127.0.0.1", 0) as server:
        yield f"ws://127.0.0.1:{server.sockets[0].getsockname()[1]}"


class CharacterVoice:
    """A server with ElevenLabs' protocol `stream-input`: 100 ms a character, `size` characters a message.

    Times in a message count from the start of its sound.
    """

    def __init__(self, size: int, spelling: str = "charDurationsMs", fault: str | None = None) -> None:
        self.size, self.spelling, self.fault = size, spelling, fault
        self.path, self.key = "", ""

    async def __call__(self, socket: ServerConnection) -> None:
        assert socket.request is not None
        self.path, self.key = socket.request.path, socket.request.headers["xi-api-key"]
        text, opened = "", False
        async for message in socket:
            asked = json.loads(message)
            assert asked["text"].endswith(" ") or asked["text"] == ""
            if asked["text"] == "":
                break
            text += asked["text"] if opened else ""
            opened = True
        if self.fault:
            await socket.send(json.dumps({"message": self.fault, "error": "quota", "code": 1008}))
            return
        for at in range(0, len(text), self.size):
            chars = text[at : at + self.size]
            times = {"chars": [*chars], "charStartTimesMs": [100 * k for k in range(len(chars))]}
            times[self.spelling] = [100] * len(chars)
            sound = base64.b64encode(tone(0.1 * len(chars), elevenlabs.RATE)).decode()
            await socket.send(
                json.dumps({"audio": sound, "isFinal": None, "alignment": None, "normalizedAlignment": times})
            )
        await socket.send(json.dumps({"audio": None, "isFinal": True}))


@pytest.mark.parametrize("size", [1, 3, 7, 100])
@pytest.mark.parametrize("spelling", ["charDurationsMs", "charsDurationsMs"])
def test_elevenlabs_voice_gives_the_times_of_words(size: int, spelling: str) -> None:
    words, found, text = elevenlabs.Words(), [], "Hi you, there "
    for at in range(0, len(text), size):
        chars = text[at : at + size]
        times = {"chars": [*chars], "charStartTimesMs": [100 * k for k in range(len(chars))]}
        found += words.feed(times | {spelling: [100] * len(chars)}, 0.1 * at)
    assert [(pytest.approx(a), pytest.approx(b), word) for a, b, word in found] == [
        (0.0, 0.2, "Hi"),
        (0.3, 0.7, "you,"),
        (0.8, 1.3, "there"),
    ]


class Recorder(Client):
    """A client that also keeps the sound that it sends, and the words by their times in the speech."""

    def voice(self, **options: Any) -> Any:
        voice = super().voice(**options)
        send, control = voice._send, voice._control
        self.sound, self.words = b"", list[tuple[float, str]]()

        async def keep(message: bytes) -> None:
            self.sound += unpack_clip(message).sound
            await send(message)

        async def note(type: str, **fields: Any) -> None:
            begin = len(self.sound) / 2 / elevenlabs.RATE  # words come before their sound
            self.words += [(begin + word["start"], word["text"]) for word in fields.get("words", ())]
            await control(type, **fields)

        voice._send, voice._control = keep, note
        return voice


@pytest.mark.parametrize("size", [2, 5, 40])
def test_elevenlabs_voice_sends_all_sound_and_words(size: int, monkeypatch: pytest.MonkeyPatch) -> None:
    sizes = [min(size, 18 - at) for at in range(0, 18, size)]
    voice, used = CharacterVoice(size), []

    async def test() -> Any:
        async with (
            asyncio.timeout(LIMIT),
            Server(Settings(port=0, voice="silent")) as server,
            voice_server(voice) as url,
            connect(server.url) as face,
            open_socket(f"{url}/v1", additional_headers={"xi-api-key": "k"}) as socket,
        ):
            face.__class__ = Recorder
            used.append(face)
            monkeypatch.setattr(elevenlabs, "connect", lambda address: contextlib.nullcontext(face))
            return await elevenlabs.say(server.url, socket, ["Hi you,", "there now"])

    assert asyncio.run(test()).status == "DONE"
    assert (voice.path, voice.key) == ("/v1", "k")
    assert used[0].sound == b"".join(tone(0.1 * count, elevenlabs.RATE) for count in sizes)
    words = [(0.0, "Hi"), (0.3, "you,"), (0.8, "there"), (1.4, "now")]
    assert used[0].words == [(pytest.approx(time, abs=1e-3), word) for time, word in words]


def test_elevenlabs_voice_says_why_it_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    async def test() -> None:
        async with (
            asyncio.timeout(LIMIT),
            Server(Settings(port=0, voice="silent")) as server,
            voice_server(CharacterVoice(3, fault="no credits are left")) as url,
            open_socket(url, additional_headers={"xi-api-key": "k"}) as socket,
        ):
            await elevenlabs.say(server.url, socket, ["Hi"])

    with pytest.raises(SystemExit, match="the voice refused: no credits are left"):
        asyncio.run(test())


class RealtimeModel:
    """A server with the events of OpenAI's Realtime API: each answer is 3 s of sound, sent at once."""

    def __init__(self, prefix: str) -> None:
        self.prefix = prefix  # output_audio, or audio in older versions
        self.events: list[dict[str, Any]] = []
        self.truncated = asyncio.Event()
        self.count = 0

    async def __call__(self, socket: ServerConnection) -> None:
        async def send(type: str, **fields: Any) -> None:
            await socket.send(json.dumps({"type": type, "event_id": f"e{self.count}", **fields}))

        await send("session.created", session={"type": "realtime"})
        async for message in socket:
            event = json.loads(message)
            self.events.append(event)
            match event["type"]:
                case "response.create":
                    self.count += 1
                    place = {
                        "response_id": f"r{self.count}",
                        "item_id": f"item{self.count}",
                        "content_index": 0,
                    }
                    await send("response.created", response={"id": place["response_id"]})
                    sound = tone(3.0, realtime.RATE)
                    for at in range(0, len(sound), 9600):
                        delta = base64.b64encode(sound[at : at + 9600]).decode()
                        await send(f"response.{self.prefix}.delta", delta=delta, **place)
                    await send(f"response.{self.prefix}.done", **place)
                    await send(f"response.{self.prefix}_transcript.done", transcript="La.", **place)
                    await send("response.done", response={"id": place["response_id"], "status": "completed"})
                case "response.cancel":
                    await send("error", error={"message": "no active response found"})
                case "conversation.item.truncate":
                    self.truncated.set()
                    await send("conversation.item.truncated", item_id=event["item_id"])


@pytest.mark.parametrize("prefix", ["output_audio", "audio"])
@pytest.mark.slow
def test_realtime_voice_is_interrupted_and_tells_what_was_heard(
    prefix: str, capsys: pytest.CaptureFixture[str]
) -> None:
    model = RealtimeModel(prefix)

    async def test() -> None:
        async with (
            asyncio.timeout(LIMIT),
            Server(Settings(port=0, voice="silent")) as server,
            voice_server(model) as url,
            connect(f"{server.url}?session=r") as client,
            open_socket(url) as socket,
        ):
            answers = realtime.Answers(client, socket)
            running = [asyncio.create_task(answers.run()), asyncio.create_task(answers.watch())]
            await answers.ask("Sing")
            async for frame in client.sound(rate=8000):
                if np.abs(frame.values).max(initial=0) > 1000 and answers.voice is not None:
                    break
            await answers.ask("Stop singing")
            await model.truncated.wait()
            first = answers.item
            while answers.item == first:
                await asyncio.sleep(0)
            assert answers.voice is not None
            assert (await answers.voice.ended()).status == "DONE"
            for task in running:
                task.cancel()

    asyncio.run(test())
    asked = [event["type"] for event in model.events]
    assert asked == [
        *("conversation.item.create", "response.create"),
        *("response.cancel", "conversation.item.truncate"),
        *("conversation.item.create", "response.create"),
    ]
    cut = model.events[3]
    assert (cut["item_id"], cut["content_index"]) == ("item1", 0)
    assert 0 <= cut["audio_end_ms"] < 2500
    said = model.events[4]["item"]["content"]
    assert said == [{"type": "input_text", "text": "Stop singing"}]
    printed = capsys.readouterr()
    assert printed.out == "La.\nLa.\n"
    assert "the model: no active response found" in printed.err
