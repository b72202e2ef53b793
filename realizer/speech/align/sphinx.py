"""Phone alignment with pocketsphinx; its only importer."""

import importlib.util
import threading
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np

from realizer.core.array_types import Float32

INSTALL = "no aligner of English: pip install 'bml-realizer[align]'"
FRAME = 0.01  # s

_lock = threading.Lock()  # decoders are not thread-safe


@dataclass(frozen=True, slots=True)
class AlignedWord:
    """A word, with its phones as (start, end, ARPABET) in seconds.

    Attributes:
        score: the mean log likelihood of its frames relative to that of the best phone; 0 is perfect.
    """

    phones: tuple[tuple[float, float, str], ...]
    score: float


def install_hint() -> str | None:
    """Return a sentence that says how to install pocketsphinx, or None if it is installed."""
    return None if importlib.util.find_spec("pocketsphinx") else INSTALL


def align_words(
    sound: Float32, words: Sequence[tuple[str, tuple[str, ...]]]
) -> tuple[AlignedWord | None, ...] | None:
    """Align words with the sound; return None if that is impossible.

    Args:
        sound: (n,) at 16 kHz, -1..1.
        words: (spelling, phones in case the dictionary does not have it). A word without phones that is not
            in the dictionary is ignored, and its result is None.
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
