"""A dialogue by Pipecat, without microphone, network or model: a script answers, and the user interrupts it.

  realizer serve
  python examples/pipecat/dialogue.py ws://127.0.0.1:8765/ws

It prints as JSON what the context of the model holds at the end, and how long after the interruption the last
sound came. With --foreign-voice another voice speaks, which hums.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from typing import Any

import numpy as np
from face import RATE, Face, FapsFrame, HeardFrame
from pipecat.frames.frames import (
    EndFrame,
    Frame,
    InterruptionFrame,
    LLMContextFrame,
    LLMFullResponseEndFrame,
    LLMFullResponseStartFrame,
    LLMTextFrame,
    OutputAudioRawFrame,
    TranscriptionFrame,
    TTSAudioRawFrame,
    TTSStartedFrame,
    TTSStoppedFrame,
    TTSTextFrame,
)
from pipecat.pipeline.pipeline import Pipeline
from pipecat.pipeline.worker import PipelineParams, PipelineWorker
from pipecat.processors.aggregators.llm_context import LLMContext
from pipecat.processors.aggregators.llm_response_universal import (
    LLMContextAggregatorPair,
    LLMUserAggregatorParams,
)
from pipecat.processors.frame_processor import FrameDirection, FrameProcessor
from pipecat.transports.base_output import BaseOutputTransport
from pipecat.transports.base_transport import TransportParams
from pipecat.turns.user_start import TranscriptionUserTurnStartStrategy
from pipecat.turns.user_stop import SpeechTimeoutUserTurnStopStrategy
from pipecat.turns.user_turn_strategies import UserTurnStrategies
from pipecat.workers.runner import WorkerRunner

ANSWERS = (
    "Once there was a face that talked and talked, and nobody could ever make it stop, not even once.",
    "I stop now.",
)


class ScriptedModel(FrameProcessor):
    """A model that gives the next answer of a script, in tokens."""

    def __init__(self) -> None:
        super().__init__()
        self._answers = iter(ANSWERS)

    async def process_frame(self, frame: Frame, direction: FrameDirection) -> None:
        await super().process_frame(frame, direction)
        if not isinstance(frame, LLMContextFrame):
            await self.push_frame(frame, direction)
            return
        await self.push_frame(LLMFullResponseStartFrame())
        answer = next(self._answers, "Good.")
        for at in range(0, len(answer), 4):
            await self.push_frame(LLMTextFrame(answer[at : at + 4]))
        await self.push_frame(LLMFullResponseEndFrame())


class Humming(FrameProcessor):
    """A voice that hums: a tone of 0.25 s for each word. It stands for a service of text to speech."""

    def __init__(self) -> None:
        super().__init__()
        self._text = ""

    async def process_frame(self, frame: Frame, direction: FrameDirection) -> None:
        await super().process_frame(frame, direction)
        if isinstance(frame, LLMTextFrame):
            self._text += frame.text
            return
        if isinstance(frame, LLMFullResponseEndFrame) and self._text:
            text, self._text = self._text, ""
            t = np.arange(RATE // 4) / RATE
            hum = (8000 * np.sin(2 * np.pi * 150 * t) * np.sin(4 * np.pi * t)).astype("<i2").tobytes()
            await self.push_frame(TTSStartedFrame())
            await self.push_frame(TTSTextFrame(text, "sentence"))
            for _ in text.split():
                await self.push_frame(TTSAudioRawFrame(hum, RATE, 1))
            await self.push_frame(TTSStoppedFrame())
        await self.push_frame(frame, direction)


class Loudspeaker(BaseOutputTransport):
    """An output that plays nothing, in the time that playing takes, and notes when there was sound."""

    def __init__(self) -> None:
        params = TransportParams(audio_out_enabled=True, audio_out_sample_rate=RATE, audio_out_10ms_chunks=2)
        super().__init__(params)
        self.last_sound = 0.0
        self.interrupted = 0.0
        self.heard: list[str] = []
        self.faps = 0

    async def start(self, frame: Any) -> None:
        await super().start(frame)
        await self.set_transport_ready(frame)

    async def process_frame(self, frame: Frame, direction: FrameDirection) -> None:
        if isinstance(frame, InterruptionFrame):
            self.heard.append("|")
        self.heard += [frame.text] if isinstance(frame, HeardFrame) else []
        self.faps += isinstance(frame, FapsFrame)
        await super().process_frame(frame, direction)

    async def write_audio_frame(self, frame: OutputAudioRawFrame) -> bool:
        length = len(frame.audio) / 2 / frame.sample_rate
        if np.abs(np.frombuffer(frame.audio, "<i2").astype(int)).max(initial=0) > 100:
            self.last_sound = time.monotonic() + length
        await asyncio.sleep(length)
        return True


async def main(url: str, *, foreign_voice: bool = False) -> None:
    """Act as a user: ask, and interrupt the answer."""
    context = LLMContext()
    turns = UserTurnStrategies(
        start=[TranscriptionUserTurnStartStrategy()], stop=[SpeechTimeoutUserTurnStopStrategy()]
    )
    params = LLMUserAggregatorParams(user_turn_strategies=turns, user_turn_stop_timeout=0.3)
    aggregators = LLMContextAggregatorPair(context, user_params=params)
    face, output = Face(url, foreign_voice=foreign_voice), Loudspeaker()
    voice = [Humming()] if foreign_voice else []
    worker = PipelineWorker(
        Pipeline([aggregators.user(), ScriptedModel(), *voice, face, output, aggregators.assistant()]),
        params=PipelineParams(audio_out_sample_rate=RATE),
        cancel_on_idle_timeout=False,
    )

    async def said(count: int) -> None:
        while len([word for word in output.heard if word != "|"]) < count:
            await asyncio.sleep(0.01)

    async def user_says(text: str) -> None:
        await worker.queue_frame(TranscriptionFrame(text, "user", time.strftime("%FT%TZ"), finalized=True))

    silences = []

    async def talk() -> None:
        await user_says("Tell me a story.")
        if foreign_voice:
            while not output.last_sound:
                await asyncio.sleep(0.01)
            await asyncio.sleep(1)
        else:
            await said(4)
        interrupted = time.monotonic()
        await user_says("Stop, please.")
        while "|" not in output.heard[1:]:
            await asyncio.sleep(0.001)
        await asyncio.sleep(0.2)
        silences.append(output.last_sound - interrupted)
        while not [m for m in context.get_messages() if m["role"] == "assistant"][1:]:
            await asyncio.sleep(0.05)
        await worker.queue_frame(EndFrame())

    runner = WorkerRunner(handle_sigint=False)
    await runner.add_workers(worker)
    await asyncio.gather(runner.run(), talk())
    result = {
        "context": [(m["role"], m["content"]) for m in context.get_messages()],
        "heard": output.heard,
        "silence_ms": round(1000 * max(0.0, silences[0]), 1),
        "faps": output.faps,
    }
    print(json.dumps(result))


if __name__ == "__main__":
    asyncio.run(main(sys.argv[1], foreign_voice="--foreign-voice" in sys.argv))
