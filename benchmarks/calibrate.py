"""Measures how late a voice sounds: `python benchmarks/calibrate.py NAME [--aligner A]`.

Prints the median difference between the word onsets that an aligner finds and those that the voice reports,
in twelve English sentences. Add it to `offset` in realizer/tables/hibari.toml.
"""

from __future__ import annotations

import argparse
import sys

import numpy as np
from align import SENTENCES

from realizer.core.errors import RealizerError
from realizer.speech.registry import find_voice
from realizer.speech.utterance import SpeechRequest
from realizer_studio.align.aligner import align


def main() -> None:
    reader = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    reader.add_argument("voice", help="a voice of `realizer voices`")
    reader.add_argument("--aligner", choices=["pocketsphinx", "espeak"], default="pocketsphinx")
    options = reader.parse_args()
    voice = find_voice(options.voice)
    late: list[float] = []
    for text in SENTENCES["en-US"]:
        utterance = voice.say(SpeechRequest(text))
        if utterance.pcm is None:
            sys.exit(f"{options.voice} has no sound: there is nothing to calibrate")
        try:
            found = align(utterance.pcm, utterance.sample_rate, text, aligner=options.aligner)
        except RealizerError as error:
            print(f"{text!r} is left out: {error}")
            continue
        if found.confidence > 0.5:
            late += [a.start - b.start for a, b in zip(found.words, utterance.words, strict=True)]
    voice.close()
    if not late:
        sys.exit("no sentence could be aligned")
    ms = 1000 * np.array(late)
    median = np.median(ms)
    low, high = np.percentile(ms, (25, 75))
    print(
        f"{options.voice}: add {median / 1000:+.3f} s to its offset; {len(ms)} words, half of them "
        f"{low:.0f}..{high:.0f} ms, median deviation {np.median(abs(ms - median)):.0f} ms"
    )


if __name__ == "__main__":
    main()
