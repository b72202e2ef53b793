"""The aligner for English, by the acoustic model of pocketsphinx, which only this module imports."""

import importlib.util
import sys
import threading
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from realizer import tables
from realizer.core.array_types import Float32
from realizer.speech.utterance import Phoneme, Utterance
from realizer_studio.align import sphinx
from realizer_studio.align.alignment import Alignment, build, probability

INSTALL = "no aligner of English: pip install 'bml-realizer[align]'"
NO_WHEEL = (
    "no aligner of English: pocketsphinx has no wheels for Python 3.14 and later; use Python 3.11 to 3.13"
)
FRAME = 0.01  # s

_lock = threading.Lock()  # decoders are not thread-safe


@dataclass(frozen=True, slots=True)
class AlignedWord:
    """A word, with its phones as (start, end, ARPABET) in seconds."""

    phones: tuple[tuple[float, float, str], ...]
    score: float  # the mean log likelihood of its frames relative to that of the best phone; 0 is perfect


def install_hint() -> str | None:
    """Return a sentence that says what to install for pocketsphinx, or None if it is installed."""
    if importlib.util.find_spec("pocketsphinx"):
        return None
    return INSTALL if sys.version_info < (3, 14) else NO_WHEEL


def align_words(
    sound: Float32, words: Sequence[tuple[str, tuple[str, ...]]]
) -> tuple[AlignedWord | None, ...] | None:
    """Align words with the sound, (n,) at 16 kHz, -1..1; return None if that is impossible.

    A word has its spelling, and phones in case the dictionary does not have it. Without phones and not in the
    dictionary it is ignored, and its result is None.
    """
    pcm = np.clip(np.rint(sound * 32767), -32768, 32767).astype("<i2").tobytes()
    with _lock:
        decoder = _decoder()
        names = [_dictionary_name(decoder, spelling, phones) for spelling, phones in words]
        if not any(names):
            return None
        try:
            decoder.set_align_text(" ".join(filter(None, names)))
            _decode(decoder, pcm)
            if decoder.hyp() is None:
                return None
            decoder.set_alignment()
            _decode(decoder, pcm)
            found = [_aligned_word(word) for word in decoder.get_alignment() if word.name[0] not in "<[("]
        except RuntimeError:
            # After a failed pass the decoder is in an undefined state.
            _decoder.cache_clear()
            return None
    if len(found) != sum(1 for name in names if name):
        return None
    rest = iter(found)
    return tuple(next(rest) if name else None for name in names)


@cache
def _decoder() -> Any:
    from pocketsphinx import Decoder

    return Decoder(samprate=16000, lm=None, loglevel="FATAL")


def _dictionary_name(decoder: Any, spelling: str, phones: Sequence[str]) -> str:
    """Return the name of the word in the decoder's dictionary, adding it if needed; "" without phones."""
    plain = spelling.lower().replace("’", "'")
    if decoder.lookup_word(plain) is not None:
        return plain
    if not phones:
        return ""
    name = "_" + "_".join(phones)
    if decoder.lookup_word(name) is None:
        decoder.add_word(name, " ".join(phones), True)
    return name


def _decode(decoder: Any, pcm: bytes) -> None:
    decoder.reinit_feat()  # forget earlier noise, so that the same sound gives the same times
    decoder.start_utt()
    decoder.process_raw(pcm, full_utt=True)
    decoder.end_utt()


def _aligned_word(word: Any) -> AlignedWord:
    phones = tuple((p.start * FRAME, (p.start + p.duration) * FRAME, p.name, p.score) for p in word)
    frames = sum(end - start for start, end, _, _ in phones) / FRAME
    return AlignedWord(
        tuple((start, end, name) for start, end, name, _ in phones),
        sum(score for *_, score in phones) / max(frames, 1.0),
    )


# The score (`AlignedWord`) of a probability of 1/2, and the width of the curve, which separates right texts
# from wrong ones in human speech and that of espeak-ng.
SCORE, SCORE_OF_WORD = (-35.0, 4.0), (-45.0, 8.0)
UNSTRESSED = {"ʌ": "ə", "ɝ": "ɚ"}
VOWELS = set("aeiouæɑɔəɚɛɝɪʊʌ")
FILE = "phonemes_arpabet.csv"
STRIPPED = str.maketrans("", "", "ːˑˈˌ̩̯̃̍͡ʲʰˀ_-~|")


def model_align(sound: Float32, duration: float, reference: Utterance) -> Alignment | None:
    """Align words by the acoustic model; return None if it does not find them.

    Words that are not in its dictionary have the phonemes of the reference, a voice's utterance of the text.
    The sound is (n,) at 16 kHz, `duration` in seconds.
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
