"""Measures voices: `python benchmarks/speech.py [VOICE ...]` prints milliseconds for each voice.

    start      the first text, with the start of the engine's process
    sentence   text -> utterance (sound, words, phonemes), and text -> lip channels
    paragraph  the same for eight sentences
    longest    text of the largest allowed length; real-time factors are of the path from text to lip channels
    first      time from a message to the first packet with sound, for a sentence of a speech that is sent
               in parts, and for a document with a text of the largest length
    same       how many of 200 repetitions without a cache give the same samples and times

Targets: a sentence to its lip channels in 15 ms, first sound after 30 ms and a real-time factor below 0.01
with espeak, and below 0.05 with hibari.
"""

from __future__ import annotations

import argparse
import json
import statistics
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from stopwatch import noise

from realizer.animation.lips.lip_sync import lip_channels
from realizer.core.settings import Settings
from realizer.protocol.wire import unpack
from realizer.server.session.effects import Send, Speak
from realizer.server.session.session import Session
from realizer.speech.duration_fit import speak_to_length
from realizer.speech.engine_voice import UtteranceCache
from realizer.speech.registry import find_voice, voices
from realizer.speech.utterance import MAX_TEXT, SpeechRequest, Utterance, Voice

SENTENCE = "Hello, I am very pleased to meet you, number {}."
PARAGRAPH = "I am number {0}, and it would have been the one of the best that you have seen. " * 8
LONGEST = "Number {} is here, and it is late; nobody knows why we should have been there. "
ROUNDS = 30
REPEATS = {"espeak": 200, "hibari": 20}


def milliseconds(call: Callable[[int], object]) -> tuple[float, float]:
    """Return median and 99th percentile of `ROUNDS` calls."""
    spent = []
    for k in range(ROUNDS):
        begin = time.perf_counter()
        call(k)
        spent.append((time.perf_counter() - begin) * 1000)
    return statistics.median(spent), sorted(spent)[int(0.99 * ROUNDS)]


def lips(voice: Voice, text: str) -> Utterance:
    """Compute the lip channels of a text, and return its utterance."""
    utterance = voice.say(SpeechRequest(text))
    lip_channels(utterance.phonemes, 0.0)
    return utterance


def first_sound(voice: Voice, message: str) -> float:
    """Return the milliseconds from a message to the first packet that is not silent."""
    session = Session("benchmark", Settings(), time.perf_counter())
    session.connect(1, time.perf_counter())
    session.receive(1, json.dumps({"type": "subscribe", "stream": "audio"}), time.perf_counter())
    session.take_effects()
    begin = time.perf_counter()
    session.receive(1, message, begin)
    while True:
        for effect in session.take_effects():
            match effect:
                case Speak(id, say):
                    session.on_speech(
                        id, speak_to_length(voice, replace(say, voice=None)), time.perf_counter()
                    )
                case Send(_, bytes() as data):
                    frame = unpack(data)
                    if frame.stream == "audio" and np.any(frame.values):
                        session.close()
                        return 1000 * (time.perf_counter() - begin)
        session.tick(time.perf_counter())


def measure(voice: Voice) -> None:
    begin = time.perf_counter()
    lips(voice, "first")
    print(f"{voice.name}: start {1000 * (time.perf_counter() - begin):.0f} ms")
    for name, text in (("sentence", SENTENCE), ("paragraph", PARAGRAPH)):
        utterance = lips(voice, text.format("x"))
        spoken, worst = milliseconds(lambda k, text=text: voice.say(SpeechRequest(text.format(k))))
        whole, _ = milliseconds(lambda k, text=text: lips(voice, text.format(100 + k)))
        print(
            f"  {name} of {utterance.duration:.2f} s, {len(utterance.phonemes)} phonemes: "
            f"utterance {spoken:.2f} ms (p99 {worst:.2f}), to the lips {whole:.2f} ms, "
            f"real-time factor {whole / 1000 / utterance.duration:.5f}"
        )
    text = "".join(LONGEST.format(k) for k in range(MAX_TEXT // len(LONGEST)))[:MAX_TEXT]
    begin = time.perf_counter()
    utterance = lips(voice, text)
    spent = time.perf_counter() - begin
    print(
        f"  longest of {utterance.duration:.0f} s: {1000 * spent:.0f} ms, "
        f"real-time factor {spent / utterance.duration:.5f}"
    )
    if utterance.pcm is not None:
        for name, message in (
            (
                "sentence",
                lambda k: json.dumps({"type": "speech", "id": "s", "append": f"{SENTENCE.format(k)} "}),
            ),
            (
                "document",
                lambda k: f'<bml id="b"><speech id="s"><text>{k}. {text[:-100]}</text></speech></bml>',
            ),
        ):
            spent = sorted(first_sound(voice, message(200 + k)) for k in range(ROUNDS))
            print(
                f"  first sound of a {name} after {statistics.median(spent):.1f} ms, at most {spent[-1]:.1f}"
            )
    again, _ = milliseconds(lambda k: voice.say(SpeechRequest("first")))
    print(f"  the same text again {again:.4f} ms")
    repeats = REPEATS.get(voice.name, 0)
    if repeats:
        first = lips(voice, SENTENCE)
        same = 0
        for _ in range(repeats):
            vars(voice)["_kept"] = UtteranceCache()  # so that it is synthesized again
            utterance = voice.say(SpeechRequest(SENTENCE))
            same += (utterance.words, utterance.phonemes) == (first.words, first.phonemes) and np.array_equal(
                utterance.pcm if utterance.pcm is not None else [], first.pcm if first.pcm is not None else []
            )
        print(f"  same {same} of {repeats}")
    voice.close()


def main() -> None:
    form = argparse.RawDescriptionHelpFormatter
    reader = argparse.ArgumentParser(description=__doc__, formatter_class=form)
    reader.add_argument("voice", nargs="*", help="default: all voices that are installed")
    names = reader.parse_args().voice or [voice.name for voice in voices() if voice.available]
    print(noise())
    for name in names:
        measure(find_voice(name))


if __name__ == "__main__":
    main()
