"""A model that answers with sound, as OpenAI's Realtime API does: the face speaks it, and can be interrupted.

  realizer serve
  OPENAI_API_KEY=... python examples/realtime_voice.py

Type a line; one that is typed while the face speaks interrupts it, and the model is told how much was heard.
Lips follow the sound, as the model gives no times. Arguments: other addresses of the face and of the model.
"""

from __future__ import annotations

import asyncio
import base64
import json
import os
import sys
from typing import Any

from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as open_socket

from bml_schema.feedback import BlockProgress
from realizer.client import Client, connect
from realizer.client.voice import Voice

OPENAI = "wss://api.openai.com/v1/realtime?model=gpt-realtime"
RATE = 24000  # of the sound that models send


class Answers:
    """The answers of a model, spoken by a face."""

    def __init__(self, client: Client, socket: ClientConnection) -> None:
        self.client, self.socket = client, socket
        self.voice: Voice | None = None
        self.item = ""  # the model's id of the answer that is spoken, or was interrupted
        self.begun: dict[str, float] = {}  # block -> when its sound began

    async def send(self, type: str, **fields: Any) -> None:
        await self.socket.send(json.dumps({"type": type, **fields}))

    async def ask(self, text: str) -> None:
        await self.interrupt()
        said = {"type": "message", "role": "user", "content": [{"type": "input_text", "text": text}]}
        await self.send("conversation.item.create", item=said)
        await self.send("response.create")

    async def interrupt(self) -> None:
        """Stop the face, and tell the model how much was heard."""
        voice, self.voice = self.voice, None
        if voice is None or voice.progress.is_finished:
            return
        await voice.stop()
        end = await voice.ended()
        heard = end.global_time - self.begun.get(f"{voice.id}.1:start", end.global_time)
        await self.send("response.cancel")  # refused, and harmless, if the model has said everything already
        place = {"item_id": self.item, "content_index": 0}
        await self.send("conversation.item.truncate", audio_end_ms=round(1000 * heard), **place)

    async def watch(self) -> None:
        async for element in self.client.feedback():
            if isinstance(element, BlockProgress):
                self.begun[element.id] = element.global_time

    async def run(self) -> None:
        """Pass sound from the model to the face."""
        async for message in self.socket:
            event = json.loads(message)
            match event["type"].replace("output_audio", "audio"):  # events had shorter names until 2025
                case "response.audio.delta" if self.voice or event["item_id"] != self.item:
                    if event["item_id"] != self.item:
                        self.voice, self.item = self.client.voice(rate=RATE), event["item_id"]
                    await self.voice.write(base64.b64decode(event["delta"]))
                case "response.audio.done" if self.voice:
                    await self.voice.close()
                case "response.audio_transcript.done":
                    print(event["transcript"], flush=True)
                case "input_audio_buffer.speech_started":  # a microphone, whose sound another program sends
                    await self.interrupt()
                case "error":
                    print(f"the model: {event['error']['message']}", file=sys.stderr)


async def main(face: str = "ws://127.0.0.1:8765/ws", model: str = OPENAI) -> None:
    key = {"Authorization": f"Bearer {os.environ.get('OPENAI_API_KEY', '')}"}
    opening = open_socket(model, additional_headers=key, max_size=None)
    async with connect(face) as client, opening as socket, asyncio.TaskGroup() as tasks:
        answers = Answers(client, socket)
        running = [tasks.create_task(each) for each in (answers.run(), answers.watch())]
        while line := await asyncio.to_thread(sys.stdin.readline):
            await answers.ask(line.strip())
        for task in running:
            task.cancel()


if __name__ == "__main__":
    try:
        asyncio.run(main(*sys.argv[1:3]))
    except OSError as error:  # such as no service
        sys.exit(str(error))
