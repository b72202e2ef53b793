"""Words spread evenly over the time with speech."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.speech.align.uniform_align import INSTALL, uniform_align
from realizer.speech.silent import SilentVoice
from realizer.speech.utterance import SpeechRequest

TIMES = np.arange(48_000) / 16_000
TONE = 0.3 * np.sin(2 * np.pi * 300 * TIMES)


def test_uniform_align_skips_silence() -> None:
    loud = ((TIMES > 0.5) & (TIMES < 1.0)) | ((TIMES > 2.0) & (TIMES < 2.5))
    reference = SilentVoice().say(SpeechRequest("one two"))
    found = uniform_align(np.where(loud, TONE, 0).astype(np.float32), 3.0, reference)
    first, second = found.words
    assert (first.start, first.end) == (pytest.approx(0.5, abs=0.03), pytest.approx(1.0, abs=0.03))
    assert second.start >= first.end
    assert second.end == pytest.approx(2.5, abs=0.03)
    assert (found.aligner, found.confidence, found.confidences) == ("even", 0.0, (0.0, 0.0))
    assert found.warnings == (INSTALL,)


def test_uniform_align_keeps_the_proportions_of_the_reference() -> None:
    reference = SilentVoice().say(SpeechRequest("banana dog"))  # three vowel units, and one
    first, second = uniform_align(TONE.astype(np.float32), 3.0, reference).words
    assert first.end - first.start == pytest.approx(3 * (second.end - second.start), rel=0.1)
