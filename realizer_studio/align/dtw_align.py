"""The aligner for any language: dynamic time warping against a voice that speaks the same text."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from realizer.core.array_types import Bool, Float32, Float64, Index
from realizer.speech.utterance import Utterance
from realizer_studio.align import features as f
from realizer_studio.align.alignment import Alignment, moved, probability
from realizer_studio.align.dtw import Observed, States, best_path, quiet, usual

COARSE, FINE = 320, 80  # samples between frames: 20 and 5 ms
COARSE_REACH, FINE_REACH = 30.0, 0.4  # s on each side of the diagonal, and of the coarse path
MIN_SPEED, MAX_SPEED = 0.4, 2.5  # of the reference, to match the rate of the recording
MIN_SPEECH = 0.2  # s
RIDGE = 30.0  # regularisation, in frames, when the reference is adapted to the recorded voice
# Cost with the probability 1/2, and width of the curve; they separate right from wrong texts in human speech
# and speech of espeak-ng. The cost of the same sounds in the wrong order is 1.
COST, COST_OF_WORD = (0.935, -0.01), (1.0, -0.05)


@dataclass(frozen=True, eq=False)
class _Match:
    """A voice's utterance at the speed of the recording, and the coarse path between the two."""

    reference: Utterance
    spoken: Float32
    speed: float
    states: States
    observed: Observed
    path: Index
    costs: Float64
    null: float

    @property
    def cost(self) -> float:
        voiced = ~self.states.pause[self.path]
        return float(self.costs[voiced].mean()) / self.null if voiced.any() else 1.0


def dtw_align(sound: Float32, duration: float, references: Sequence[Utterance]) -> Alignment:
    """Warp the most similar of several utterances, of one text by different voices, to the recording.

    The sound is (n,) at 16 kHz, not silent; `duration` is in seconds.

    Source: Malfrère and Dutoit 1997, who align speech by synthesis.
    """
    best = min((_match(sound, reference) for reference in references), key=lambda match: match.cost)
    reference, states, path = best.reference, best.states, best.path

    # Align again near the coarse path, with a higher resolution and a voice that is adapted to the recording.
    energy = f.energies(sound, FINE)
    activity, is_speech = f.voice_activity(f.loudness(energy))
    fine = _states(best.spoken, FINE * best.speed, reference)
    change = _adaptation(best.observed.features, states, path)
    adapted = States(
        np.hstack([fine.features, np.ones((len(fine.times), 1))]) @ change, fine.pause, fine.times
    )
    observed = _observed(f.cepstra(energy), activity, is_speech, adapted)
    coarse_frames = np.minimum(np.arange(len(energy)) * FINE // COARSE, len(path) - 1)
    centre = np.maximum.accumulate(
        np.searchsorted(fine.times, states.times[path[coarse_frames]]).astype(np.intp)
    )
    centre[-1] = len(fine.times) - 1
    fine_path, _ = best_path(observed, adapted, centre, round(FINE_REACH * f.RATE / FINE))

    def spans(pairs: Sequence[tuple[float, float]]) -> Float64:
        return _spans(np.array(pairs).reshape(-1, 2), fine, fine_path) * FINE / f.RATE

    words = spans([(word.start, word.end) for word in reference.words])
    phonemes = spans([(p.start, p.end) if p.ipa else (np.nan, np.nan) for p in reference.phonemes])
    costs = _costs(words, path, best.costs, states.pause, best.null)
    confidences = [probability(cost, COST_OF_WORD) for cost in costs]
    return moved("espeak", reference, duration, words, phonemes, confidences, probability(best.cost, COST))


def _match(sound: Float32, reference: Utterance) -> _Match:
    assert reference.pcm is not None
    spoken = f.resampled((reference.pcm / 32768).astype(np.float32), reference.sample_rate)
    seconds = sum(p.end - p.start for p in reference.phonemes if p.ipa)
    energy = f.energies(sound, COARSE)
    activity, is_speech = f.voice_activity(f.loudness(energy))
    speed = max(seconds, MIN_SPEECH) / max(float(is_speech.sum()) * COARSE / f.RATE, MIN_SPEECH)
    speed = min(max(speed, MIN_SPEED), MAX_SPEED)
    states = _states(spoken, COARSE * speed, reference)
    observed = _observed(f.cepstra(energy), activity, is_speech, states)
    centre = np.rint(np.linspace(0, len(states.times) - 1, len(energy))).astype(np.intp)
    reach = max(round(COARSE_REACH * f.RATE / COARSE), 1)
    path, costs = best_path(observed, states, centre, reach)
    null = _wrong_text_cost(observed, states, centre, reach)
    return _Match(reference, spoken, speed, states, observed, path, costs, null)


def _states(spoken: Float32, hop: float, reference: Utterance) -> States:
    """Return the frames of the reference, with one pause before each word and at the end for its pauses."""
    values = f.cepstra(f.energies(spoken, hop))
    times = np.arange(len(values)) * hop / f.RATE
    voiced = np.ones(len(times), bool)
    for phoneme in reference.phonemes:
        if not phoneme.ipa:
            voiced &= (times < phoneme.start) | (times >= phoneme.end)
    if not voiced.any():
        voiced[:] = True
    values = f.normalised(values, voiced)[voiced]
    times = times[voiced]
    starts = [word.start for word in reference.words]
    word = np.maximum(np.searchsorted(starts, times + 1e-9, side="right") - 1, 0)
    breaks = np.append(np.flatnonzero(np.diff(word, prepend=-1)), len(times))
    return States(
        np.insert(values, breaks, 0.0, axis=0),
        np.insert(np.zeros(len(times), bool), breaks, True),
        np.insert(times, breaks, np.append(times, times[-1] + hop / f.RATE)[breaks]),
    )


def _observed(values: Float64, activity: Float64, is_speech: Bool, states: States) -> Observed:
    values = f.normalised(values, is_speech)
    unit = usual(values[is_speech] if is_speech.any() else values, states.features[~states.pause])
    return Observed(values, quiet(activity, f.HEARD), unit)


def _adaptation(values: Float64, states: States, path: Index) -> Float64:
    """Return the affine map (d + 1, d) from the reference's features to the recording's."""
    pairs = ~states.pause[path]
    inputs = np.hstack([states.features[path[pairs]], np.ones((int(pairs.sum()), 1))])
    identity = np.eye(inputs.shape[1])
    change = np.linalg.solve(
        inputs.T @ inputs + RIDGE * identity, inputs.T @ values[pairs] + RIDGE * identity[:, :-1]
    )
    return np.asarray(change, np.float64)


def _wrong_text_cost(observed: Observed, states: States, centre: Index, reach: int) -> float:
    """Return the cost of a wrong text: the least cost of the same sounds in other orders."""
    places = np.arange(len(states.times))
    found = [1.0]
    for order in (places[::-1], *(np.roll(places, len(places) * third // 3) for third in (1, 2))):
        pause = states.pause[order]
        pause[[0, -1]] = True
        path, costs = best_path(observed, States(states.features[order], pause, states.times), centre, reach)
        voiced = ~pause[path]
        if voiced.any():
            found.append(float(costs[voiced].mean()))
    return max(min(found[1:] or found), 1e-6)


def _costs(words: Float64, path: Index, costs: Float64, pause: Bool, null: float) -> Float64:
    """Return the mean cost (n,) of the frames of each word."""
    voiced = ~pause[path]
    total = np.append(0.0, np.cumsum(np.where(voiced, costs, 0.0)))
    count = np.append(0, np.cumsum(voiced))
    first, last = (np.clip(np.rint(words * f.RATE / COARSE), 0, len(path)).astype(np.intp)).T
    last = np.minimum(np.maximum(last, first + 1), len(path))
    first = np.minimum(first, last - 1)
    frames = count[last] - count[first]
    return np.where(frames > 0, (total[last] - total[first]) / np.maximum(frames, 1) / null, 1.0)


def _spans(pairs: Float64, states: States, path: Index) -> Float64:
    """Return (n, 2) the frames at which the path enters and leaves the interval between two times."""
    voiced = np.flatnonzero(~states.pause)
    times = states.times[voiced]
    first = np.searchsorted(times, pairs[:, 0] - 1e-9)
    last = np.searchsorted(times, pairs[:, 1] - 1e-9) - 1
    enters = np.searchsorted(path, voiced[np.minimum(first, len(voiced) - 1)])
    leaves = np.searchsorted(path, voiced[np.clip(last, 0, len(voiced) - 1)], side="right")
    found = np.stack([enters, np.maximum(enters, leaves)], axis=1).astype(np.float64)
    found[np.isnan(pairs).any(axis=1)] = np.nan
    return found
