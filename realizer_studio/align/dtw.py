"""Dynamic time warping of two feature sequences, with optional pauses."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from realizer.core.array_types import Bool, Float64, Index

# Costs in units of the usual difference between a frame and a state, tuned on human and synthetic speech.
STAY, SKIP, SKIP_TWO = 0.3, 0.3, 1.0  # staying in a state, and skipping one or two
ENTER = 5.0  # beginning a pause; high, because weak sounds and closures resemble pauses
SILENT, NOT_SILENT = 0.35, 8.0  # a silent frame in a pause, and the additional cost of loudness 1
NOISE = 2.0  # greatest cost of a frame in a pause, for breaths and coughs
IMPOSSIBLE = 1e30
BATCH = 256  # frames whose costs are computed together
SAMPLES = 300  # rows and columns from which the usual difference is computed


@dataclass(frozen=True, eq=False)
class States:
    """The expected sounds, in order."""

    features: Float64  # (j, d); rows of pauses are ignored
    pause: Bool  # (j,) whether the state is an optional pause, such as the first and the last one
    times: Float64  # (j,) seconds in the reference; for a pause, those of the next state


@dataclass(frozen=True, eq=False)
class Observed:
    """The recorded sounds."""

    features: Float64  # (t, d), normalised like those of the states
    quiet: Float64  # (t,) cost of each frame in a pause
    usual: float  # the unit of costs: the median difference of a frame and a state


def distance(features: Float64, others: Float64) -> Float64:
    """Return the root mean square differences (t, j) of features (t, d) and (j, d)."""
    squares = (features**2).sum(axis=1)[:, None] + (others**2).sum(axis=1)
    squares = np.maximum(squares - 2 * (features @ others.T), 0.0)
    return np.asarray(np.sqrt(squares / features.shape[1]), np.float64)


def usual(features: Float64, others: Float64) -> float:
    sampled = (rows[:: max(1, len(rows) // SAMPLES)] for rows in (features, others))
    return max(float(np.median(distance(*sampled))), 1e-6)


def quiet(part: Float64, threshold: float) -> Float64:
    """Return the costs (t,) of frames in a pause, by their loudness between silence (0) and speech (1)."""
    return np.minimum(SILENT + NOT_SILENT * np.maximum(0.0, part - threshold), NOISE)


def best_path(
    observed: Observed, states: States, centre: Index | None = None, reach: int = 0
) -> tuple[Index, Float64]:
    """Return the cheapest path: the state (t,) and the cost (t,) of each frame.

    From one frame to the next the state stays the same or advances by up to three (dynamic time warping with
    slopes 0 to 3). It is free to skip a pause or to stay in it. Time and memory are proportional to t times
    the width of the band: `reach` states on each side of `centre` (t,), which does not fall; None for no
    band.

    Source: Sakoe and Chiba 1978, with optional pauses.
    """
    frames, count = len(observed.features), len(states.times)
    width = count if centre is None else min(count, 2 * reach + 1)
    lows = np.zeros(frames, np.intp) if centre is None else np.clip(centre - reach, 0, count - width)
    penalties = _penalties(states.pause)
    stay, enter, two, three = penalties
    steps = np.zeros((frames, width), np.int8)
    costs = _costs(observed, states, lows, width)
    total = np.full(width + 3, IMPOSSIBLE)  # index: state - low + 3; the first three are impossible
    total[3:5] = next(costs)[:2]
    candidates, columns = np.empty((4, width)), np.arange(width)
    for t in range(1, frames):
        low, shift = int(lows[t]), int(lows[t] - lows[t - 1])
        if shift:
            moved = np.full(width + 3, IMPOSSIBLE)
            moved[: max(0, width + 3 - shift)] = total[shift:]
            total = moved
        band = slice(low, low + width)
        np.add(total[3:], stay[band], out=candidates[0])
        np.add(total[2:-1], enter[band], out=candidates[1])
        np.add(total[1:-2], two[band], out=candidates[2])
        np.add(total[:-3], three[band], out=candidates[3])
        steps[t] = candidates.argmin(axis=0)
        total[3:], total[:3] = candidates[steps[t], columns] + next(costs), IMPOSSIBLE
    path = _trace_back(steps, lows, width - 1 - int(total[-1] > total[-2]))
    cost = np.sqrt(((observed.features - states.features[path]) ** 2).mean(axis=1)) / observed.usual
    cost = np.where(states.pause[path], observed.quiet, cost)
    cost[1:] += penalties[np.diff(path), path[1:]]
    return path, cost


def _penalties(pause: Bool) -> Float64:
    """Return the costs (4, j) of staying in a state, and of advancing to it by one, two or three states."""
    enter = np.where(pause, ENTER, 0.0)
    enter[[0, -1]] = 0.0  # silence before and after the text is free
    skips_pause = np.append(False, pause[:-1])
    skips_pause_of_two = skips_pause | np.append([False, False], pause[:-2])[: len(pause)]
    stay = np.where(pause, 0.0, STAY)
    two, three = np.where(skips_pause, 0.0, SKIP), np.where(skips_pause_of_two, SKIP, SKIP_TWO)
    return np.stack([stay, enter, enter + two, enter + three])


def _costs(observed: Observed, states: States, lows: Index, width: int) -> Iterator[Float64]:
    for k in range(0, len(lows), BATCH):
        band = slice(int(lows[k]), int(lows[k : k + BATCH][-1]) + width)
        rows = distance(observed.features[k : k + BATCH], states.features[band]) / observed.usual
        rows[:, states.pause[band]] = observed.quiet[k : k + BATCH, None]
        for row, low in zip(rows, lows[k : k + BATCH] - lows[k], strict=True):
            yield row[low : low + width]


def _trace_back(steps: npt.NDArray[np.int8], lows: Index, last: int) -> Index:
    """Return the states (t,) of the path that ends at `last` in its band."""
    path = np.empty(len(lows), np.intp)
    state = int(lows[-1]) + last
    for t in range(len(lows) - 1, -1, -1):
        path[t] = state
        state -= int(steps[t, state - lows[t]])
    return path
