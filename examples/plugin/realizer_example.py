"""A behaviour, output, voice, transport, face and editor, added to bml-realizer by entry points."""

from __future__ import annotations

import asyncio
import json
import os
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np

from bml_schema.behaviours import PEAK
from bml_schema.node_schema import attribute, node
from bml_schema.nodes import Behaviour
from bml_schema.values import one_of
from realizer.behaviours import pose_channels
from realizer.behaviours.kind import BehaviourKind, table_timing
from realizer.face.load import folder_of
from realizer.outputs import speech_spans
from realizer.outputs.output import Output
from realizer.server.transports.tcp_listener import TcpTransport
from realizer.sources import spoken
from realizer.speech.silent import SilentVoice

# A behaviour: <wink xmlns="urn:realizer-example" id="w" side="LEFT"/> closes an eye (action unit 43).


@node
class Wink(Behaviour):
    """One eye closes and opens."""

    tag = "{urn:realizer-example}wink"
    sync_points = PEAK  # start, attackPeak, relax, end
    side: str = attribute(one_of("LEFT", "RIGHT"), default="LEFT")


def expand(node, times, context):
    return pose_channels.hold(pose_channels.columns({(43, node.side): 1.0}, 1.0), times, node.id)


KINDS = (BehaviourKind(Wink, table_timing("faceLexeme", "RAISE_BROWS"), expand),)

# An output: `realizer realize hello.bml -o hello.words` writes a line for each word.


def encode(realization, settings):
    spans = [span for speech in realization.speeches for span in speech_spans.words(speech)]
    return "".join(f"{span.start:.3f} {span.text}\n" for span in spans).encode()


WORDS = Output(".words", "text/plain", "words with their times", encode)

# A voice: `--voice hum` hums; words and lips have the times of the silent voice.


class Hum(SilentVoice):
    name = "hum"
    engine = "a tone"
    description = "hums a tone for each sound, in any language"

    def say(self, request):
        said, rate = super().say(request), 16_000
        pcm = np.zeros(round(said.duration * rate), np.int16)
        for phoneme in said.phonemes:
            first, last = round(phoneme.start * rate), min(len(pcm), round(phoneme.end * rate))
            if phoneme.ipa:
                pcm[first:last] = 3000 * np.sin(np.arange(last - first) * 2 * np.pi * 140 / rate)
        return replace(said, sample_rate=rate, pcm=pcm, duration=len(pcm) / rate)


# A transport: lines of text over TCP are spoken, lines of feedback come back. Try: nc 127.0.0.1 7700


class Lines(TcpTransport):  # called with the session host and the settings
    def __init__(self, sessions, settings):
        port = int(os.environ.get("LINES_PORT", "7700"))
        super().__init__("lines", settings.host, port, settings.max_connections, settings.allow)
        self.sessions = sessions

    @property
    def startup_lines(self):
        return (f"lines: text at {self.address}",)

    async def _handle(self, host, reader, writer):
        number, count = self.sessions.join(Client(writer), "lines"), 0
        try:
            while line := (await reader.readline()).decode("utf-8", "replace").strip():
                count += 1
                self.sessions.receive(number, line if line.startswith("<") else spoken(line, count))
                await self.sessions.wait_for_room(number)
        finally:
            self.sessions.leave(number)


class Client:
    """The way out to a client of `Lines`."""

    def __init__(self, writer: asyncio.StreamWriter):
        self.writer = writer

    @property
    def unsent_bytes(self):
        return self.writer.transport.get_write_buffer_size()

    def send(self, data):
        if isinstance(data, str) and data.startswith("<"):
            self.writer.write(data.encode() + b"\n")

    def disconnect(self, code, reason):
        self.writer.transport.abort()


# Faces: a folder of face folders. This one has a copy of ada under another name.
FACES = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "realizer-example"
if not (FACES / "eve" / "face.toml").is_file():
    shutil.copytree(folder_of("ada"), FACES / "eve", dirs_exist_ok=True)

# An editor: it answers {"id": 1, "text": "hello"} at ws://HOST:PORT/capitals by {"id": 1, "text": "HELLO"}.


class Capitals:
    def __init__(self, settings, may_save):
        self.may_save = may_save

    def answer(self, message):
        asked = json.loads(message)
        return json.dumps({"id": asked["id"], "text": asked["text"].upper()})

    def close(self):
        """Nothing is held."""
