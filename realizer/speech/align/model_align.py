"""The aligner for English, which uses the acoustic model of pocketsphinx."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache

import numpy as np

from realizer import tables
from realizer.core.array_types import Float32
from realizer.speech.align import sphinx
from realizer.speech.align.alignment import Alignment, build, probability
from realizer.speech.utterance import Phoneme, Utterance

# The score (`AlignedWord`) of a probability of 1/2, and the width of the curve, which separates right texts
# from wrong ones in human speech and that of espeak-ng.
SCORE, SCORE_OF_WORD = (-35.0, 4.0), (-45.0, 8.0)
UNSTRESSED = {"ʌ": "ə", "ɝ": "ɚ"}
VOWELS = set("aeiouæɑɔəɚɛɝɪʊʌ")
FILE = "phonemes_arpabet.csv"
STRIPPED = str.maketrans("", "", "ːˑˈˌ̩̯̃̍͡ʲʰˀ_-~|")


def model_align(sound: Float32, duration: float, reference: Utterance) -> Alignment | None:
    """Align words by the acoustic model; return None if it does not find them.

    Words that are not in its dictionary have the phonemes of the reference.

    Args:
        sound: (n,) at 16 kHz.
        duration: seconds of the recording.
        reference: a voice's utterance of the text.
    """
    of_words = [
        [p for p in reference.phonemes if p.ipa and word.start - 1e-6 <= p.start < word.end - 1e-6]
        for word in reference.words
    ]
    wanted = [
        (word.text, to_arpabet(p.ipa for p in own))
        for word, own in zip(reference.words, of_words, strict=True)
    ]
    aligned = sphinx.align_words(sound, wanted)
    if aligned is None:
        return None
    spans, phonemes, owners, latest = [], [], [], 0.0
    for k, (word, own) in enumerate(zip(aligned, of_words, strict=True)):
        if word is not None:
            stresses = [p.stress for p in own if p.ipa[0] in VOWELS]
            sounds = [(start, end, to_ipa(name)) for start, end, name in word.phones]
            vowels = sum(ipa[:1] in VOWELS for *_, ipa in sounds)
            rest = iter(stresses if vowels == len(stresses) else [0] * vowels)
            for start, end, ipa in sounds:
                stress = next(rest) if ipa[:1] in VOWELS else 0
                phonemes.append(Phoneme(start, end, ipa if stress else UNSTRESSED.get(ipa, ipa), stress))
                owners.append(k)
            latest = word.phones[-1][1]
        spans.append((word.phones[0][0], latest) if word is not None else (latest, latest))
    found = [word for word in aligned if word is not None]
    lengths = np.array([word.phones[-1][1] - word.phones[0][0] for word in found])
    score = float(np.average([word.score for word in found], weights=lengths))
    return build(
        "pocketsphinx",
        reference,
        duration,
        np.array(spans),
        (phonemes, owners),
        [0.0 if word is None else probability(word.score, SCORE_OF_WORD) for word in aligned],
        probability(score, SCORE),
    )


@dataclass(frozen=True, slots=True)
class Sounded:
    """One or two phones of ARPABET, and their IPA."""

    arpabet: str
    ipa: str


def to_arpabet(ipa: Iterable[str]) -> tuple[str, ...]:
    """Return the phones of phonemes; symbols that are not in the table are ignored."""
    phones: list[str] = []
    for phoneme in ipa:
        text, at = phoneme.translate(STRIPPED), 0
        while at < len(text):
            size = next((n for n in range(len(text) - at, 0, -1) if text[at : at + n] in _phones()), 0)
            if size:
                phones += _phones()[text[at : at + size]].split()
            at += size or 1
    return tuple(phones)


def to_ipa(phone: str) -> str:
    """Return the IPA of one phone; "" for silence and noise."""
    return _sounds().get(phone, "")


@cache
def _phones() -> Mapping[str, str]:
    return {row.ipa: row.arpabet for row in tables.csv_rows(FILE, Sounded)}


@cache
def _sounds() -> Mapping[str, str]:
    return {row.arpabet: row.ipa for row in reversed(tables.csv_rows(FILE, Sounded))}
