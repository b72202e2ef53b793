"""Measures the errors of aligners: `python benchmarks/align.py` prints errors of word onsets in ms.

Synthetic speech gets noise, and the reference are the times of its engine. For five human recordings
(Debian's package pocketsphinx-testdata, or `--recordings DIR`) the reference are the times of pocketsphinx,
so that only the other aligner is measured.
"""

from __future__ import annotations

import argparse
import os
import time
import wave
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np

from realizer.core.errors import RealizerError
from realizer.speech.registry import find_voice
from realizer.speech.utterance import SpeechRequest
from realizer_studio.align.aligner import align
from realizer_studio.align.alignment import Alignment

RECORDINGS = Path("/usr/share/pocketsphinx/test/data/librivox")
NEEDED = "no recordings in {}: apt-get install pocketsphinx-testdata, or --recordings DIR"
SENTENCES = {
    "en-US": (
        "Hello, I am very pleased to meet you.",
        "The tall woman carried a basket of apples down the hill.",
        "She had nothing to say, so she left the room quietly.",
        "Please put the large box next to the window, not under the table.",
        "Yesterday it rained all day; today the sun is shining.",
        "My brother works in a small bakery near the river.",
        "Can you tell me where the station is?",
        "We will be back before the end of the week.",
        "Nobody knows why the old lighthouse was abandoned.",
        "Five people were waiting for the last bus home.",
        "If you want to catch the train, you should hurry.",
        "Our neighbours painted their kitchen bright yellow.",
    ),
    "nl": (
        "Goedemorgen, hoe gaat het met u?",
        "De trein naar Utrecht vertrekt over vijf minuten.",
        "Mijn zus woont in een klein huis aan het water.",
        "Wij gaan morgen samen naar de markt.",
    ),
    "fr": (
        "Bonjour, comment allez-vous aujourd'hui?",
        "Le petit chat dort sur le canapé du salon.",
        "Nous avons mangé du pain et du fromage.",
        "Il fait froid ce matin, prenez votre manteau.",
    ),
    "de": (
        "Guten Morgen, wie geht es Ihnen heute?",
        "Der Zug nach Hamburg hat zehn Minuten Verspätung.",
        "Meine Schwester wohnt in einem kleinen Haus am See.",
        "Wir gehen morgen zusammen auf den Markt.",
    ),
    "pl": (
        "Dzień dobry, jak się pan dzisiaj czuje?",
        "Pociąg do Krakowa odjeżdża za pięć minut.",
        "Moja siostra mieszka w małym domu nad rzeką.",
        "Jutro pójdziemy razem na targ.",
    ),
}
# Other voices than those that the aligner itself synthesizes.
VARIANTS = {"en-US": ("en-us+f4", "en-gb+m3", "en-us+f2", "en-us+m7")}
RATES = (0.85, 1.0, 1.15)
NOISES = (20.0, 15.0, 25.0)  # dB below the speech
SILENCE = (0.0, 0.3, 0.6)  # s before and after, with the noise


@dataclass(frozen=True, eq=False)
class Sample:
    """A recording and the seconds at which its words begin, if they are known."""

    language: str
    text: str
    rate: int
    pcm: np.ndarray
    onsets: np.ndarray | None


def synthesize(name: str, language: str) -> Iterator[Sample]:
    """Yield the sentences of a language as a voice speaks them, with added noise."""
    random = np.random.default_rng(7)
    voice = find_voice(name)
    variants = VARIANTS.get(language, (f"{language}+f2", f"{language}+m3")) if name == "espeak" else (None,)
    for k, text in enumerate(SENTENCES[language]):
        utterance = voice.say(
            SpeechRequest(
                text, language=language, voice=variants[k % len(variants)], rate=RATES[k % len(RATES)]
            )
        )
        pause = round(SILENCE[k % len(SILENCE)] * utterance.sample_rate)
        clean = np.pad(utterance.pcm.astype(float), pause)
        noise_level = np.sqrt((utterance.pcm.astype(float) ** 2).mean()) / 10 ** (
            NOISES[k % len(NOISES)] / 20
        )
        noisy = 0.5 * (clean + random.normal(0, noise_level, len(clean)))
        onsets = np.array([word.start for word in utterance.words]) + pause / utterance.sample_rate
        pcm = np.clip(noisy, -32768, 32767).astype(np.int16)
        yield Sample(language, text, utterance.sample_rate, pcm, onsets)
    voice.close()


def read_recordings(folder: Path) -> Iterator[Sample]:
    """Yield the human recordings with their texts."""
    for line in (folder / "transcription").read_text("utf-8").splitlines():
        text, _, name = line.replace("<s>", "").replace("</s>", "").rpartition(" (")
        with wave.open(str(folder / f"{name.rstrip(')')}.wav")) as file:
            pcm = np.frombuffer(file.readframes(file.getnframes()), "<i2")
            yield Sample("en-US", text.strip(), file.getframerate(), pcm, None)


def try_align(sample: Sample, text: str, aligner: str | None) -> Alignment | None:
    try:
        return align(sample.pcm, sample.rate, text, sample.language, aligner=aligner)
    except RealizerError:
        return None


def measure(name: str, samples: list[Sample], aligner: str, truth: str = "its own times") -> None:
    """Print the errors of an aligner, and its confidence with the right text and with another one."""
    errors: list[float] = []
    right: list[float] = []
    wrong: list[float] = []
    failed = 0
    elapsed = seconds = 0.0
    for sample, other in zip(samples, [*samples[1:], samples[0]], strict=True):
        onsets = sample.onsets
        if onsets is None:
            reference = try_align(sample, sample.text, "pocketsphinx")
            onsets = np.array([w.start for w in reference.words]) if reference else None
        try_align(sample, sample.text, aligner)  # the first call includes loading and starting
        begin = time.perf_counter()
        result = try_align(sample, sample.text, aligner)
        elapsed += time.perf_counter() - begin
        seconds += len(sample.pcm) / sample.rate
        if result is None or onsets is None:
            failed += 1
            continue
        errors += list(np.array([w.start for w in result.words]) - onsets)
        right.append(result.confidence)
        mismatch = try_align(sample, other.text, aligner)
        wrong.append(mismatch.confidence if mismatch else 0.0)
    if not errors:
        print(f"{name:<18} {aligner:<13} all {failed} failed")
        return
    ms = 1000 * np.array(errors)
    print(
        f"{name:<18} {aligner:<13} {len(ms):>4} words  shift {np.median(ms):>4.0f}  "
        f"median {np.median(abs(ms)):>3.0f}  p90 {np.percentile(abs(ms), 90):>3.0f}  "
        f"worst {abs(ms).max():>4.0f}  against {truth}, "
        f"{failed} of {len(samples)} failed, real-time factor {elapsed / seconds:.3f}"
    )
    print(
        f"{'':<18} confidence of the right text {min(right):.2f}..{max(right):.2f}, "
        f"of a wrong one {min(wrong):.2f}..{max(wrong):.2f}"
    )


def main() -> None:
    reader = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    reader.add_argument("--recordings", type=Path, default=RECORDINGS, metavar="DIR")
    folder: Path = reader.parse_args().recordings
    for voice in ("espeak", "hibari"):
        try:
            samples = list(synthesize(voice, "en-US"))
        except RealizerError as error:
            print(f"{voice}: {error}")
            continue
        for aligner in ("pocketsphinx", "espeak"):
            measure(f"{voice} en-US", samples, aligner)
        if voice == "espeak":
            for language in ("nl", "fr", "de", "pl"):
                measure(f"espeak {language}", list(synthesize(voice, language)), "espeak")
    if (folder / "transcription").is_file():
        measure("human", list(read_recordings(folder)), "espeak", "pocketsphinx")
    else:
        print(NEEDED.format(folder))


if __name__ == "__main__":
    main()
