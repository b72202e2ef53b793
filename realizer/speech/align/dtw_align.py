"""The aligner for any language: dynamic time warping against a voice that speaks the same text."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from realizer.core.array_types import Bool, Float32, Float64, Index
from realizer.speech.align import features as f
from realizer.speech.align.alignment import Alignment, moved, probability
from realizer.speech.align.dtw import Observed, States, best_path, quiet, usual
from realizer.speech.utterance import Utterance

COARSE, FINE = 320, 80  # samples between frames: 20 and 5 ms
FAR, NEAR = 30.0, 0.4  # s on each side of the diagonal, and of the coarse path, that are searched
SLOWEST, FASTEST = 0.4, 2.5  # limits of the factor by which the reference is brought to the recording's rate
LEAST = 0.2  # s of speech
RIDGE = 30.0  # regularisation, in frames, when the reference is adapted to the recorded voice
# The cost of a probability of 1/2, and the width of the curve, which separates right texts from wrong ones in
# human speech and that of espeak-ng. The cost of the same sounds in the wrong order is 1.
COST, COST_OF_WORD = (0.935, -0.01), (1.0, -0.05)


@dataclass(frozen=True, eq=False)
class _Match:
    """A voice's utterance at the speed of the recording, and the coarse path between the two."""

    reference: Utterance
    spoken: Float32
    speed: float
    states: States
    heard: Observed
    way: Index
    spent: Float64
    null: float

    @property
    def cost(self) -> float:
        voiced = ~self.states.pause[self.way]
        return float(self.spent[voiced].mean()) / self.null if voiced.any() else 1.0


def dtw_align(sound: Float32, duration: float, references: Sequence[Utterance]) -> Alignment:
    """Warp the most similar of several utterances to the recording.

    Args:
        sound: (n,) at 16 kHz, not silent.
        duration: seconds of the recording.
        references: the same text by different voices, with sound.

    Source: Malfrère and Dutoit 1997, who align speech by synthesis.
    """
    best = min((_matched(sound, reference) for reference in references), key=lambda match: match.cost)
    reference, states, way = best.reference, best.states, best.way

    # Again with the voice adapted to the recording, at a higher resolution, and only near the coarse path.
    energy = f.energies(sound, FINE)
    part, talks = f.voice_activity(f.loudness(energy))
    fine = _states(best.spoken, FINE * best.speed, reference)
    change = _adaptation(best.heard.features, states, way)
    likened = States(
        np.hstack([fine.features, np.ones((len(fine.times), 1))]) @ change, fine.pause, fine.times
    )
    heard = _observed(f.cepstra(energy), part, talks, likened)
    about = np.minimum(np.arange(len(energy)) * FINE // COARSE, len(way) - 1)
    centre = np.maximum.accumulate(np.searchsorted(fine.times, states.times[way[about]]).astype(np.intp))
    centre[-1] = len(fine.times) - 1
    closely, _ = best_path(heard, likened, centre, round(NEAR * f.RATE / FINE))

    def spans(pairs: Sequence[tuple[float, float]]) -> Float64:
        return _spans(np.array(pairs).reshape(-1, 2), fine, closely) * FINE / f.RATE

    words = spans([(word.start, word.end) for word in reference.words])
    phonemes = spans([(p.start, p.end) if p.ipa else (np.nan, np.nan) for p in reference.phonemes])
    costs = _costs(words, way, best.spent, states.pause, best.null)
    each = [probability(cost, COST_OF_WORD) for cost in costs]
    return moved("espeak", reference, duration, words, phonemes, each, probability(best.cost, COST))


def _matched(sound: Float32, reference: Utterance) -> _Match:
    assert reference.pcm is not None
    spoken = f.resampled((reference.pcm / 32768).astype(np.float32), reference.sample_rate)
    seconds = sum(p.end - p.start for p in reference.phonemes if p.ipa)
    energy = f.energies(sound, COARSE)
    part, talks = f.voice_activity(f.loudness(energy))
    speed = max(seconds, LEAST) / max(float(talks.sum()) * COARSE / f.RATE, LEAST)
    speed = min(max(speed, SLOWEST), FASTEST)
    states = _states(spoken, COARSE * speed, reference)
    heard = _observed(f.cepstra(energy), part, talks, states)
    centre = np.rint(np.linspace(0, len(states.times) - 1, len(energy))).astype(np.intp)
    reach = max(round(FAR * f.RATE / COARSE), 1)
    way, spent = best_path(heard, states, centre, reach)
    null = _wrong_text_cost(heard, states, centre, reach)
    return _Match(reference, spoken, speed, states, heard, way, spent, null)


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


def _observed(values: Float64, part: Float64, talks: Bool, states: States) -> Observed:
    values = f.normalised(values, talks)
    unit = usual(values[talks] if talks.any() else values, states.features[~states.pause])
    return Observed(values, quiet(part, f.HEARD), unit)


def _adaptation(values: Float64, states: States, way: Index) -> Float64:
    """Return the affine map (d + 1, d) from the reference's features to the recording's."""
    pairs = ~states.pause[way]
    ours = np.hstack([states.features[way[pairs]], np.ones((int(pairs.sum()), 1))])
    same = np.eye(ours.shape[1])
    change = np.linalg.solve(ours.T @ ours + RIDGE * same, ours.T @ values[pairs] + RIDGE * same[:, :-1])
    return np.asarray(change, np.float64)


def _wrong_text_cost(heard: Observed, states: States, centre: Index, reach: int) -> float:
    """Return the cost of a wrong text: the least cost of the same sounds in other orders."""
    places = np.arange(len(states.times))
    found = [1.0]
    for order in (places[::-1], *(np.roll(places, len(places) * part // 3) for part in (1, 2))):
        pause = states.pause[order]
        pause[[0, -1]] = True
        way, spent = best_path(heard, States(states.features[order], pause, states.times), centre, reach)
        voiced = ~pause[way]
        if voiced.any():
            found.append(float(spent[voiced].mean()))
    return max(min(found[1:] or found), 1e-6)


def _costs(words: Float64, way: Index, spent: Float64, pause: Bool, null: float) -> Float64:
    """Return the mean cost (n,) of the frames of each word."""
    voiced = ~pause[way]
    total = np.append(0.0, np.cumsum(np.where(voiced, spent, 0.0)))
    count = np.append(0, np.cumsum(voiced))
    first, last = (np.clip(np.rint(words * f.RATE / COARSE), 0, len(way)).astype(np.intp)).T
    last = np.minimum(np.maximum(last, first + 1), len(way))
    first = np.minimum(first, last - 1)
    frames = count[last] - count[first]
    return np.where(frames > 0, (total[last] - total[first]) / np.maximum(frames, 1) / null, 1.0)


def _spans(pairs: Float64, states: States, way: Index) -> Float64:
    """Return (n, 2) the frames at which the path enters and leaves the interval between two times."""
    voiced = np.flatnonzero(~states.pause)
    times = states.times[voiced]
    first = np.searchsorted(times, pairs[:, 0] - 1e-9)
    last = np.searchsorted(times, pairs[:, 1] - 1e-9) - 1
    enters = np.searchsorted(way, voiced[np.minimum(first, len(voiced) - 1)])
    leaves = np.searchsorted(way, voiced[np.clip(last, 0, len(voiced) - 1)], side="right")
    found = np.stack([enters, np.maximum(enters, leaves)], axis=1).astype(np.float64)
    found[np.isnan(pairs).any(axis=1)] = np.nan
    return found
