"""Phone alignment with pocketsphinx; its only importer."""

from __future__ import annotations

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

_lock = threading.Lock()  # a decoder is for one thread at a time


@dataclass(frozen=True, slots=True)
class AlignedWord:
    """A word: its phones as (start, end, ARPABET), in seconds, and how well the model knows them.

    Attributes:
        score: the mean over its frames of the log likelihood against that of the best sound there is; 0 is
            perfect.
    """

    phones: tuple[tuple[float, float, str], ...]
    score: float


def install_hint() -> str | None:
    """None where pocketsphinx is installed; otherwise the sentence that says what to install."""
    return None if importlib.util.find_spec("pocketsphinx") else INSTALL


def align_words(
    sound: Float32, words: Sequence[tuple[str, tuple[str, ...]]]
) -> tuple[AlignedWord | None, ...] | None:
    """What was found for each word; None where the sound cannot be the words, or the model does not know how.

    Args:
        sound: (n,) at 16 kHz, -1..1.
        words: (spelling, its phones if the dictionary does not have it). A word without either is left out,
            and gets None.
    """
    pcm = np.clip(np.rint(sound * 32767), -32768, 32767).astype("<i2").tobytes()
    with _lock:
        decoder = _decoder()
        names = [_known(decoder, spelling, phones) for spelling, phones in words]
        if not any(names):
            return None
        try:
            decoder.set_align_text(" ".join(filter(None, names)))
            _hear(decoder, pcm)
            if decoder.hyp() is None:
                return None
            decoder.set_alignment()
            _hear(decoder, pcm)
            found = [_aligned_word(word) for word in decoder.get_alignment() if word.name[0] not in "<[("]
        except RuntimeError:
            # A pass that failed leaves the decoder in the middle of it.
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


def _known(decoder: Any, spelling: str, phones: Sequence[str]) -> str:
    """The name of the word in the decoder's dictionary; "" where it cannot be said."""
    plain = spelling.lower().replace("’", "'")
    if decoder.lookup_word(plain) is not None:
        return plain
    if not phones:
        return ""
    name = "_" + "_".join(phones)
    if decoder.lookup_word(name) is None:
        decoder.add_word(name, " ".join(phones), True)
    return name


def _hear(decoder: Any, pcm: bytes) -> None:
    decoder.reinit_feat()  # forget the noise of what was heard before: the same sound gives the same times
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
