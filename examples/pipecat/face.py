"""A processor for Pipecat: a talking face, which speaks the answers of a model and knows what was heard.

  pip install bml-realizer pipecat-ai
  realizer serve
  python examples/pipecat/dialogue.py ws://127.0.0.1:8765/ws

Put it between the model, or its voice, and the output; the aggregator of the assistant comes last:

  Pipeline([transport.input(), stt, user, llm, Face("ws://127.0.0.1:8765/ws"), transport.output(), assistant])
  Pipeline([..., llm, tts, Face("ws://127.0.0.1:8765/ws", foreign_voice=True), transport.output(), assistant])

Without `foreign_voice` the realizer speaks the text of the model while it comes. With it, the face speaks the
sound of `tts`, a segment at a time, with the lips of its text. What comes out: sound (`TTSAudioRawFrame`),
MPEG-4's parameters (`FapsFrame`), pictures if `size` is given (`OutputImageRawFrame`), and `HeardFrame`, the
words that were spoken, which the aggregator of the assistant puts into the context. An interruption stops the
face: first come the last words that were heard, then the `InterruptionFrame`, and no sound of that answer.
"""

from __future__ import annotations

import asyncio
import contextlib
import re
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any
from xml.sax.saxutils import escape

from pipecat.frames.frames import (
    DataFrame,
    EndFrame,
    Frame,
    InterruptionFrame,
    LLMFullResponseEndFrame,
    LLMFullResponseStartFrame,
    OutputImageRawFrame,
    SystemFrame,
    TextFrame,
    TranscriptionFrame,
    TTSAudioRawFrame,
    TTSSpeakFrame,
    TTSStartedFrame,
    TTSStoppedFrame,
    TTSTextFrame,
)
from pipecat.processors.frame_processor import FrameDirection, FrameProcessor, FrameProcessorSetup

from realizer.client import Client, ClientError, Speech, Voice, connect

RATE = 24000  # Hz, of the sound that comes out
AHEAD = 0.1  # s; so long before its time the service sends sound
LEAD = 0.02  # s; so long before its time it is passed on


@dataclass
class FapsFrame(DataFrame):
    """The 68 parameters of MPEG-4 at a time of the session, in FAPU."""

    values: list[int] = field(default_factory=list)
    time: float = 0.0


@dataclass
class HeardFrame(SystemFrame, TextFrame):
    """Words that were spoken. An interruption does not overtake it, because it is a system frame too."""


class Face(FrameProcessor):
    """A face of a running service.

    Args:
        url: of the service, such as ws://127.0.0.1:8765/ws?session=show.
        foreign_voice: whether a voice before this processor speaks; otherwise the realizer does.
        size: of pictures; None for none.
    """

    def __init__(
        self,
        url: str,
        *,
        token: str | None = None,
        foreign_voice: bool = False,
        size: tuple[int, int] | None = None,
        fps: float = 25,
        **options: Any,
    ) -> None:
        super().__init__(**options)
        self._url, self._token, self._size, self._fps = url, token, size, fps
        self._foreign = foreign_voice
        self._connected = contextlib.AsyncExitStack()
        self._client: Client
        self._tasks: list[asyncio.Task[None]] = []
        self._turn = 0
        self._speech: Speech | Voice | None = None
        self._text = ""  # that follows the last whole word, or of a segment of the foreign voice
        self._words: list[str] = []  # of this answer, as they are sent
        self._told = 0  # how many of them have come out as heard
        self._sound: list[TTSAudioRawFrame] = []  # of a segment of the foreign voice
        self._responding = False

    async def setup(self, setup: FrameProcessorSetup) -> None:
        """Connect to the service."""
        await super().setup(setup)
        self._client = await self._connected.enter_async_context(connect(self._url, token=self._token))
        follow: list[Callable[[], Awaitable[None]]] = [self._play, self._move, self._report]
        follow += [self._show] if self._size else []
        self._tasks = [self.create_task(each()) for each in follow]

    async def cleanup(self) -> None:
        """Leave the service."""
        for task in self._tasks:
            await self.cancel_task(task)
        self._tasks = []
        await self._connected.aclose()
        await super().cleanup()

    async def process_frame(self, frame: Frame, direction: FrameDirection) -> None:
        """Speak texts or sound; pass other frames on."""
        await super().process_frame(frame, direction)
        try:
            if direction is FrameDirection.UPSTREAM or not await self._take(frame):
                await self.push_frame(frame, direction)
        except ClientError as error:
            await self.push_error(error_msg=f"the face: {error}", exception=error)
            await self.push_frame(frame, direction)

    async def _take(self, frame: Frame) -> bool:
        """Handle a frame; return whether it goes no further."""
        match frame:
            case InterruptionFrame():
                await self._interrupt()
            case LLMFullResponseStartFrame():
                self._responding = True
            case LLMFullResponseEndFrame():
                self._responding = False
                await self._finish()
            case EndFrame():
                await self._finish()
            case TTSSpeakFrame() if not self._foreign:
                await self._append(frame.text + " ")
                await self._finish()
                return True
            case TTSAudioRawFrame() if self._foreign:
                self._sound.append(frame)
                return True
            case TTSTextFrame() if self._foreign:
                self._text = f"{self._text} {frame.text}"
                return True
            case TTSStoppedFrame() if self._foreign:
                await self._say_segment()
                if not self._responding:
                    await self._finish()
            case TTSStartedFrame() | TranscriptionFrame():
                return False
            case TextFrame():
                if not self._foreign and not frame.skip_tts:
                    await self._append(frame.text)
                return not isinstance(frame, HeardFrame)
        return False

    # what is spoken -----------------------------------------------------------------------------------

    def _open(self, make: Callable[[str], Speech | Voice]) -> Any:
        if self._speech is None:
            self._turn += 1
            self._words, self._told = [], 0
            self._speech = make(f"answer{self._turn}-{id(self)}")
        return self._speech

    async def _append(self, text: str) -> None:
        """Speak the whole words of the text so far; a sync before each of them reports that it begins."""
        self._text += text
        *whole, self._text = re.split(r"(?<=\s)", self._text)
        for word in whole:
            await self._word(word)

    async def _word(self, word: str) -> None:
        if word.strip():
            speech = self._open(self._client.speech)
            self._words.append(word.strip())
            await speech.append(f'<sync id="w{len(self._words) - 1}"/>{escape(word)}')

    async def _say_segment(self) -> None:
        """Speak a segment of the foreign voice; its words are found in its sound by its text."""
        sound, text = self._sound, self._text.strip()
        self._sound, self._text = [], ""
        if not sound:
            return
        rate = sound[0].sample_rate
        voice = self._open(lambda _: self._client.voice(rate=rate))
        self._words += text.split()
        await voice.clip(b"".join(frame.audio for frame in sound), rate, **({"text": text} if text else {}))

    async def _finish(self) -> None:
        """Close the answer, and wait until it is spoken."""
        await self._word(self._text)
        self._text = ""
        if self._speech is not None:
            speech = self._speech
            await speech.close()
            end = await speech.ended()
            await self._tell(len(self._words) if end.said is None else len(end.said.split()))
            self._speech = None

    async def _interrupt(self) -> None:
        """Stop the answer, and tell which of its words were heard."""
        speech, self._speech = self._speech, None
        self._text, self._sound, self._responding = "", [], False
        if speech is not None:
            with contextlib.suppress(ClientError):
                await speech.stop()
                end = await speech.ended()
                await self._tell(len((end.said or "").split()))

    async def _tell(self, count: int) -> None:
        """Pass on the first words of the answer as heard, those that were not yet."""
        for word in self._words[self._told : count]:
            await self.push_frame(HeardFrame(word))
        self._told = max(self._told, count)

    # what comes out -----------------------------------------------------------------------------------

    async def _report(self) -> None:
        """Tell of a word when the next one begins."""
        async for feedback in self._client.feedback():
            found = re.fullmatch(r"[^:]+:([^:]+):w(\d+)", getattr(feedback, "id", ""))
            if found and self._speech is not None and found[1] == self._speech.id:
                await self._tell(int(found[2]))

    async def _play(self) -> None:
        """Pass sound on shortly before its time: what waits in the output is heard after an interruption."""
        loop = asyncio.get_running_loop()
        earliest = float("inf")  # arrival of a packet, against its time
        async for packet in self._client.sound(rate=RATE):
            earliest = min(earliest, loop.time() - packet.time)
            speech = self._speech
            await asyncio.sleep(packet.time + earliest + AHEAD - LEAD - loop.time())
            if packet.payload and speech is not None and speech is self._speech:
                await self.push_frame(TTSAudioRawFrame(packet.payload, RATE, 1))

    async def _move(self) -> None:
        async for frame in self._client.faps(fps=self._fps):
            await self.push_frame(FapsFrame(frame.values.tolist(), frame.time))

    async def _show(self) -> None:
        async for picture in self._client.pictures(fps=self._fps, size=self._size):
            pixels = picture.pixels
            size = (pixels.shape[1], pixels.shape[0])
            await self.push_frame(OutputImageRawFrame(pixels.tobytes(), size, "RGB"))
