"""Tests of the output .wav."""

from __future__ import annotations

import io
import wave

import numpy as np

from realizer.outputs.output import RenderSettings
from realizer.outputs.wav import WAV, encode_wav


def test_wav_is_16_bit_mono_and_as_long_as_the_realization(realization):
    with wave.open(io.BytesIO(WAV.encode(realization, RenderSettings()))) as file:
        assert (file.getnchannels(), file.getsampwidth(), file.getframerate()) == (1, 2, 22050)
        assert file.getnframes() == round(1.5 * 22050)
        pcm = np.frombuffer(file.readframes(file.getnframes()), "<i2")
    assert np.abs(pcm[: int(0.25 * 22050)]).max() == 0
    assert np.abs(pcm[int(0.3 * 22050) : int(1.2 * 22050)]).max() > 8000


def test_wav_has_the_samples_unchanged() -> None:
    pcm = np.array([-32768, -1, 0, 1, 32767], np.int16)
    with wave.open(io.BytesIO(encode_wav(pcm, 8000))) as file:
        assert file.getframerate() == 8000
        assert np.array_equal(np.frombuffer(file.readframes(5), "<i2"), pcm)
