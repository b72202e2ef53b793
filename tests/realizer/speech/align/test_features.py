"""Cepstra, loudness and voice activity."""

from __future__ import annotations

import numpy as np

from realizer.speech.align import features as f


def tone(hertz: float, seconds: float = 1.0, loud: float = 0.3) -> np.ndarray:
    return (loud * np.sin(2 * np.pi * hertz * np.arange(round(seconds * f.RATE)) / f.RATE)).astype(np.float32)


def test_energies_of_a_tone_are_in_its_band() -> None:
    peaks = [int(f.energies(tone(hertz), 160).mean(axis=0).argmax()) for hertz in (200, 1000, 3000, 6000)]
    assert peaks == sorted(set(peaks))


def test_energies_have_a_frame_for_each_hop() -> None:
    energy = f.energies(tone(500), 100.5)
    assert len(energy) == int(f.RATE / 100.5) + 1
    assert f.cepstra(energy).shape == (len(energy), 26)


def test_voice_activity_separates_sound_from_silence() -> None:
    sound = np.concatenate([tone(400, 0.5, 1e-4), tone(400, 1.0), tone(400, 0.5, 1e-4)])
    _, talks = f.voice_activity(f.loudness(f.energies(sound, 160)))
    assert 95 <= talks.sum() <= 110
    assert not talks[:45].any()
    part, _ = f.voice_activity(np.zeros(50))
    assert part.max() == 0


def test_normalised_features_have_mean_0_and_deviation_1() -> None:
    rng = np.random.default_rng(0)
    some = rng.random(400) < 0.5
    rows = f.normalised(rng.normal(5, 3, (400, 4)), some)
    assert np.allclose(rows[some].mean(axis=0), 0, atol=1e-5)
    assert np.allclose(rows[some].std(axis=0), 1, atol=1e-5)


def test_resampled_sound_keeps_its_pitch_without_aliasing() -> None:
    times = np.arange(44_100) / 44_100
    low, high = (np.sin(2 * np.pi * hertz * times).astype(np.float32) for hertz in (1000, 15_000))
    kept = f.resampled(low, 44_100)
    assert len(kept) == f.RATE
    assert abs(np.abs(np.fft.rfft(kept)).argmax() - 1000) <= 1
    assert np.abs(f.resampled(high, 44_100)[200:-200]).max() < 0.01
