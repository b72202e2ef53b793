"""The network that hears visemes."""

from __future__ import annotations

import numpy as np

from realizer.speech.sound_visemes.mel_stream import BANDS, viseme_facts
from realizer.speech.sound_visemes.network import OFFSETS, WEIGHTS, context, log_probabilities, shares


def test_network_is_small() -> None:
    assert WEIGHTS.stat().st_size < 3e6


def test_log_probabilities_add_up_to_one_over_the_classes() -> None:
    inputs = np.random.default_rng(0).normal(size=(3, 2, len(OFFSETS) * BANDS)).astype(np.float32)
    found = log_probabilities(inputs)
    assert found.shape == (3, 2, len(viseme_facts()["class"]))
    assert np.allclose(np.exp(found).sum(axis=-1), 1, atol=1e-5)
    assert np.isclose(shares().sum(), 1, atol=0.01)


def test_log_probabilities_of_a_block_do_not_depend_on_others() -> None:
    inputs = np.random.default_rng(1).normal(size=(50, 2, len(OFFSETS) * BANDS)).astype(np.float32)
    alone = np.concatenate([log_probabilities(inputs[k : k + 1]) for k in range(50)])
    assert np.array_equal(log_probabilities(inputs), alone)


def test_context_is_the_same_at_any_level() -> None:
    log = np.random.default_rng(2).normal(-8, 2, (1, len(OFFSETS), BANDS)).astype(np.float32)
    level, mean = np.zeros(1, np.float32), np.full((1, BANDS), -5, np.float32)
    assert np.allclose(context(log, level, mean), context(log - 2, level - 2, mean), atol=1e-5)
