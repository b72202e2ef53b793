"""How long speech takes: `python tests/benchmarks/speech.py` prints milliseconds and the real-time factor."""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

from realizer.animation.lips import lip_channels
from realizer.speech import Say, SilentVoice, find_voice
from realizer.speech.utterance import Voice

SENTENCE = "Hello, I am very pleased to meet you, number {}."
PARAGRAPH = "I am number {0}, and it would have been the one of the best that you have seen. " * 8
ROUNDS = 40


def milliseconds(call: Callable[[int], object]) -> tuple[float, float]:
    """Median and 99th percentile of `ROUNDS` calls."""
    spent = []
    for k in range(ROUNDS):
        begin = time.perf_counter()
        call(k)
        spent.append((time.perf_counter() - begin) * 1000)
    return statistics.median(spent), sorted(spent)[int(0.99 * ROUNDS)]


def measure(voice: Voice) -> None:
    begin = time.perf_counter()
    voice.say(Say("first"))
    print(f"{voice.name}: first text {1000 * (time.perf_counter() - begin):.1f} ms")
    for name, text in (("sentence", SENTENCE), ("paragraph", PARAGRAPH)):
        said = voice.say(Say(text.format("x")))
        spoken, worst = milliseconds(lambda k, text=text: voice.say(Say(text.format(k))))
        lips, _ = milliseconds(lambda k, said=said: lip_channels(said.phonemes, 0.0))
        print(
            f"  {name} of {said.duration:.2f} s, {len(said.phonemes)} phonemes: utterance {spoken:.2f} ms "
            f"(p99 {worst:.2f}), visemes {lips:.2f} ms, real-time factor {spoken / 1000 / said.duration:.5f}"
        )
    again, _ = milliseconds(lambda k: voice.say(Say("first")))
    print(f"  the same text again {again:.4f} ms")
    voice.close()


if __name__ == "__main__":
    best = find_voice()
    measure(best)
    if best.name != "silent":
        measure(SilentVoice())
