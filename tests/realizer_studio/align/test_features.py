"""Cepstra, loudness and voice activity."""

import numpy as np
import pytest

from realizer_studio.align import features as f
from realizer_studio.align.alignment import AlignError
from realizer_studio.align.features import mono, to_aligner

TONE = np.sin(np.arange(8000) * 0.1)


def tone(hertz: float, seconds: float = 1.0, loud: float = 0.3) -> np.ndarray:
    return (loud * np.sin(2 * np.pi * hertz * np.arange(round(seconds * f.RATE)) / f.RATE)).astype(np.float32)


def test_energies_of_a_tone_are_in_its_band() -> None:
    peaks = [int(f.energies(tone(hertz), 160).mean(axis=0).argmax()) for hertz in (200, 1000, 3000, 6000)]
    assert peaks == sorted(set(peaks))


def test_energies_have_a_frame_for_each_hop() -> None:
    energy = f.energies(tone(500), 100.5)
    assert len(energy) == int(f.RATE / 100.5) + 1
    assert f.cepstra(energy).shape == (len(energy), 26)


def test_energies_of_a_later_sound_are_those_of_the_sound_later() -> None:
    sound = tone(700, 0.1)
    later = f.energies(np.concatenate([np.zeros(160, np.float32), sound]), 160)
    assert later[1:] == pytest.approx(f.energies(sound, 160))


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


@pytest.mark.parametrize(
    "samples",
    [
        TONE,
        TONE.astype(np.float32),
        np.rint(TONE * 2**15).clip(-(2**15), 2**15 - 1).astype(np.int16),
        np.rint(TONE * 2**31).clip(-(2**31), 2**31 - 1).astype(np.int32),
        np.stack([TONE, TONE], axis=1),
        np.stack([2 * TONE, 0 * TONE], axis=1),
    ],
)
def test_mono_scales_samples_and_mixes_channels(samples: np.ndarray) -> None:
    sound = mono(samples, 8000)
    assert sound.dtype == np.float32
    assert sound.shape == (8000,)
    assert np.abs(sound - TONE).max() < 1e-4


def test_mono_clips_floats() -> None:
    assert np.abs(mono(3 * TONE, 8000)).max() == 1.0


@pytest.mark.parametrize(
    ("pcm", "rate", "message"),
    [
        ([], 16_000, "of sound, got 0 s"),
        (np.ones((2, 16_000)), 16_000, r"samples, got the shape \(2, 16000\)"),
        (np.ones((9, 9, 9)), 16_000, r"got the shape \(9, 9, 9\)"),
        (np.ones(100, np.uint8), 16_000, "got uint8"),
        (np.full(9000, np.nan), 16_000, "wanted finite samples"),
        (np.ones(9000), 0, r"rate: wanted a whole number of 1000\.\.384000 Hz, got 0"),
        (np.ones(9000), 8000.5, r"got 8000\.5"),
        (np.ones(9000), float("nan"), "rate: .* got nan"),
        (np.ones(3_000_000), 1000, "of sound, got 3000 s"),
    ],
)
def test_mono_refuses(pcm: np.ndarray, rate: float, message: str) -> None:
    with pytest.raises(AlignError, match=message):
        mono(pcm, rate)


@pytest.mark.parametrize("rate", [8000, 11_025, 16_000, 48_000])
def test_to_aligner_resamples_to_16_khz(rate: int) -> None:
    tone = np.sin(2 * np.pi * 300 * np.arange(rate) / rate).astype(np.float32)
    wanted = np.sin(2 * np.pi * 300 * np.arange(16_000) / 16_000)
    found = to_aligner(tone, rate)
    assert len(found) == pytest.approx(16_000, abs=2)
    assert np.abs(found[1000:15_000] - wanted[1000:15_000]).max() < 0.01


def test_to_aligner_refuses_silence() -> None:
    with pytest.raises(AlignError, match="recording: wanted speech, got silence"):
        to_aligner(np.full(8000, 1e-5, np.float32), 8000)
