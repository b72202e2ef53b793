"""Measures the errors of marks: `python benchmarks/marks.py` puts 500 of them before words.

The texts have five languages. The reference are the word events that espeak-ng reports with the same samples.
If espeak-ng merges a word with the previous one, the reference is the nearest event of any word or phoneme.
If it reports a word at the nasal before it ("one of"), the reference is the word's own first phoneme.
"""

from __future__ import annotations

import argparse
import random
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from realizer.core.array_types import Float64
from realizer.speech.espeak.document import write_document
from realizer.speech.espeak.events import PHONEME, WORD, read_answer
from realizer.speech.espeak.voice import EspeakVoice, choose_voice
from realizer.speech.ssml import read_script
from realizer.speech.utterance import SpeechRequest

__all__ = ["TEXTS", "Errors", "errors"]

PLACEMENTS = 500
LIMIT = 5.0  # ms
TEXTS: Mapping[str, Sequence[str]] = {
    "en-US": (
        "Hello, I am very pleased to meet you. It is late. We should have been there at seven thirty.",
        "The brown fox jumps over the lazy dog, and it would have been one of the best. Why? Nobody knows!",
        "This is number 42. Mr. Smith paid 9 dollars; I don't know what for.",
    ),
    "nl-NL": (
        "Goedemorgen, ik ben heel blij om u te zien. Het is laat. Waar gaan we naartoe?",
        "De oude man zat op een bank in het park. Hij las de krant! Niemand zei iets.",
        "Dat zijn 42 appels en peren; ik weet niet van wie ze zijn.",
    ),
    "fr-FR": (
        "Bonjour, je suis très content de vous voir. Il est tard. Je ne sais pas où nous allons.",
        "Le vieil homme lisait un journal, n'est-ce pas ? Personne ne disait rien. Quel silence !",
        "Il y a 42 pommes et poires ; c'est un ami qui les a apportées.",
    ),
    "de-DE": (
        "Guten Morgen, ich freue mich sehr, Sie zu sehen. Es ist spät. Wohin gehen wir?",
        "Der alte Mann saß auf einer Bank im Park. Er las die Zeitung! Niemand sagte etwas.",
        "Das sind 42 Äpfel und Birnen; ich weiß nicht, wem sie gehören.",
    ),
    "pl-PL": (
        "Dzień dobry, bardzo się cieszę, że pana widzę. Jest późno. Nie wiem, dokąd idziemy.",
        "Stary człowiek siedział na ławce w parku. Czytał gazetę! Nikt nic nie mówił.",
        "To są 42 jabłka i gruszki; nie wiem, czyje one są.",
    ),
}

Errors = tuple[str, float, bool]  # language, ms, whether the engine reports that word


def errors(voice: EspeakVoice, count: int, seed: int = 0) -> Iterator[Errors]:
    """Yield the error of each of `count` marks, of which a text gets one to four."""
    draw = random.Random(seed)
    done = 0
    while done < count:
        language = draw.choice(sorted(TEXTS))
        text = draw.choice(TEXTS[language])
        document = write_document(read_script(SpeechRequest(text)))
        chosen = sorted(draw.sample(range(len(document.words)), min(draw.randint(1, 4), count - done)))
        places = [document.words[k][1] - len("<speak>") - 1 for k in chosen]
        marked = text
        for n, place in sorted(enumerate(places), reverse=True):
            marked = f'{marked[:place]}<mark name="m{n}"/>{marked[place:]}'
        utterance = voice.say(SpeechRequest(marked, tuple(f"m{n}" for n in range(len(chosen))), language))
        reported, begins = _reported(voice, marked, language)
        for n, k in enumerate(chosen):
            mark = utterance.marks[f"m{n}"]
            truth = reported.get(k, float(begins[np.abs(begins - mark).argmin()]))
            yield language, 1000 * abs(mark - truth), k in reported
            done += 1


def _reported(voice: EspeakVoice, text: str, language: str) -> tuple[dict[int, float], Float64]:
    """Return word -> seconds as the engine reports them, and the begins of all words and phonemes."""
    process = voice._process
    hello = process.hello()
    document = write_document(read_script(SpeechRequest(text)))
    name, _ = choose_voice(hello, None, language)
    events, _ = read_answer(*process.ask({"op": "say", "text": document.text, "voice": name, "wpm": 175}))
    at: dict[int, int] = {}
    latest = -1
    for k, (kind, sample, place, label) in enumerate(events):
        if kind == PHONEME and label:
            latest = sample
        elif kind == WORD:
            later = next((s for t, s, _, _ in events[k:] if t == PHONEME), sample)
            at[place] = later if sample <= latest else sample
    # After some punctuation the place is that of the blank before the word.
    rate = hello["rate"]
    words = {
        k: at.get(place, at.get(place - 1, 0)) / rate
        for k, (_, place) in enumerate(document.words)
        if place in at or place - 1 in at
    }
    begins = [sample for kind, sample, _, label in events if kind == WORD or (kind == PHONEME and label)]
    return words, np.array(begins) / rate


def main() -> None:
    form = argparse.RawDescriptionHelpFormatter
    argparse.ArgumentParser(description=__doc__, formatter_class=form).parse_args()
    voice = EspeakVoice()
    try:
        found = list(errors(voice, PLACEMENTS))
    finally:
        voice.close()
    for language in sorted(TEXTS):
        own = [ms for tag, ms, reported in found if tag == language and reported]
        merged = [ms for tag, ms, reported in found if tag == language and not reported]
        print(
            f"{language}: {len(own)} marks, worst {max(own):.3f} ms; "
            f"{len(merged)} before merged words, worst {max(merged, default=0.0):.3f} ms"
        )
    worst = max(ms for _, ms, _ in found)
    print(f"{len(found)} marks, worst {worst:.3f} ms, wanted {LIMIT:g}")


if __name__ == "__main__":
    main()
