"""A voice that streams sound with the times of its characters, as ElevenLabs does: lips follow its words.

  realizer serve
  ELEVENLABS_API_KEY=... python examples/elevenlabs_voice.py VOICE_ID "Hello, it is nice to see you."

Any server with this protocol takes the place of ElevenLabs: `--server ws://127.0.0.1:9000`.
"""

from __future__ import annotations

import argparse
import asyncio
import base64
import json
import os
import sys
from collections.abc import Iterable
from typing import Any

from websockets.asyncio.client import ClientConnection
from websockets.asyncio.client import connect as open_socket

from bml_schema.feedback import BlockProgress
from realizer.client import connect

RATE = 22050


class Words:
    """Words from characters with times, which come in messages that may end within a word."""

    def __init__(self) -> None:
        self.begun: tuple[float, float, str] | None = None  # a word whose end has not come

    def feed(self, alignment: dict[str, Any], offset: float) -> list[tuple[float, float, str]]:
        """Return the words that are complete now; times in a message count from `offset` seconds."""
        whole = []
        lengths = alignment.get("charDurationsMs") or alignment.get("charsDurationsMs")
        for char, start, length in zip(
            alignment["chars"], alignment["charStartTimesMs"], lengths, strict=True
        ):
            begin, end = offset + start / 1000, offset + (start + length) / 1000
            if not char.isspace():
                first, _, text = self.begun or (begin, end, "")
                self.begun = first, end, text + char
            elif self.begun:
                whole.append(self.begun)
                self.begun = None
        return whole


async def say(address: str, socket: ClientConnection, texts: Iterable[str]) -> BlockProgress:
    """Speak texts by a voice, and play its sound on a face; return the feedback of the end."""
    async with connect(address) as client, client.voice(rate=RATE) as voice:
        await socket.send(json.dumps({"text": " "}))  # opens the speech
        for text in texts:
            await socket.send(json.dumps({"text": text.rstrip() + " "}))
        await socket.send(json.dumps({"text": ""}))  # ends it
        words, sound, sent = Words(), b"", 0
        async for message in socket:
            part = json.loads(message)
            if "error" in part:
                sys.exit(f"the voice refused: {part.get('message') or part['error']}")
            if alignment := part.get("alignment") or part.get("normalizedAlignment"):
                # Times count from the start of the sound that the message brings.
                await voice.words(words.feed(alignment, sent / RATE + len(sound) / 2 / RATE))
            sound += base64.b64decode(part.get("audio") or "")
            last = bool(part.get("isFinal"))
            if last and words.begun:
                await voice.words([words.begun])
            # Words are given before their sound: that of an unfinished word waits.
            keep = None if last or not words.begun else 2 * (round(words.begun[0] * RATE) - sent)
            await voice.write(sound[:keep])
            sent += len(sound[:keep]) // 2
            sound = sound[len(sound[:keep]) :]
            if last:
                break
        await voice.close()
        return await voice.ended()


async def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("voice")
    parser.add_argument("text", nargs="+")
    parser.add_argument("--face", default="ws://127.0.0.1:8765/ws")
    parser.add_argument("--server", default="wss://api.elevenlabs.io")
    asked = parser.parse_args()
    url = f"{asked.server}/v1/text-to-speech/{asked.voice}/stream-input?output_format=pcm_{RATE}"
    headers = {"xi-api-key": os.environ.get("ELEVENLABS_API_KEY", "")}
    async with open_socket(url, additional_headers=headers, max_size=None) as socket:
        end = await say(asked.face, socket, asked.text)
    print(f"spoken until {end.global_time:.2f} s")


if __name__ == "__main__":
    try:
        asyncio.run(main())
    except OSError as error:  # such as no service
        sys.exit(str(error))
