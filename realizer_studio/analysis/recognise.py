"""Fuzzy recognition of emotions from FAPs (Raouzaiou et al. 2002, section 5)."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import groupby
from operator import itemgetter
from typing import Any

import numpy as np

from realizer import tables
from realizer.animation.axis import au_row
from realizer.animation.fap.conversion import to_fap
from realizer.animation.frames import AUFrames
from realizer.core.array_types import Bool, Float64
from realizer.emotions.archetypes import archetypes
from realizer.emotions.profile import Profile, split_number
from realizer.emotions.wheel import wheel
from realizer.tables.emotions import emotion_model, ring


@dataclass(frozen=True)
class Interval:
    """A time from `start` to `end` seconds with one emotion, or None, and the mean belief in it."""

    start: float
    end: float
    emotion: str | None
    certainty: float


class Recogniser:
    """Recognises profiles and emotions in FAP frames by fuzzy classes.

    The membership of a value is 1 / (1 + d^2), where d is its distance from the range of the FAP, relative to
    half of the range and the noise of landmarks (`tables/emotion_model.toml`; the shape of figure 6 is not in
    the text). FAPs that only other profiles move must be near 0. Dombi's t-norm of these memberships is
    1 / (1 + sum d^2). The belief in a profile uses the mean instead of the sum, which tolerates a few FAPs
    outside their ranges. The belief in an emotion is that of its best profile; below a least belief, a frame
    has no class. Of equal beliefs, the profile with more FAPs has priority.
    """

    def __init__(self, profiles: Iterable[Profile], strengths: Sequence[float] = (1.0,)) -> None:
        """
        Args:
            profiles: at least one.
            strengths: factors of the profiles; the best one of each profile counts.
        """
        self.profiles = tuple(profiles)
        if not self.profiles:
            raise ValueError("profiles: wanted at least one, got none")
        self._model = model = emotion_model()
        shape = (len(self.profiles), 68)
        middle, half, moved = np.zeros(shape), np.full(shape, model.absent), np.zeros(shape, bool)
        for k, profile in enumerate(self.profiles):
            for fap, (low, high) in profile.ranges.items():
                middle[k, fap - 1], half[k, fap - 1] = (low + high) / 2, (high - low) / 2
                moved[k, fap - 1] = True
        self._classes = [
            (middle * strength, np.where(moved, np.maximum(half * strength, model.least_length / 2), half))
            for strength in strengths
        ]
        self._count = moved.sum(axis=1)
        self._judged: Bool = np.asarray(moved.any(axis=0))
        self._judged[[fap - 1 for fap in model.unjudged]] = False
        self._noise = np.array([model.noise.get(row.unit, np.inf) for row in tables.faps()])
        self._emotions = [emotion_of(profile.name) for profile in self.profiles]

    def beliefs(self, frames: Any, observed: Bool | None = None) -> Float64:
        """Return the beliefs (n, profiles) in FAP frames (n, 68).

        Args:
            observed: (68,) whether each FAP was observed; None for all.

        Raises:
            ValueError: frames of another shape, or values that are not finite.
        """
        values = np.asarray(frames, np.float64)
        if values.ndim != 2 or values.shape[1] != 68:
            raise ValueError(f"frames: wanted (n, 68), got {values.shape}")
        if not np.isfinite(values).all():
            raise ValueError("frames: wanted finite values, got NaN or infinity")
        judged = np.flatnonzero(self._judged if observed is None else self._judged & observed)
        best: Float64 = np.zeros((len(values), len(self.profiles)))
        if not len(judged):
            return best
        for middle, half in self._classes:
            length = half[:, judged]
            beyond = np.maximum(np.abs(values[:, None, judged] - middle[:, judged]) - length, 0.0)
            squares = np.square(beyond / (length + self._noise[judged]))
            np.maximum(best, 1 / (1 + np.minimum(squares, self._model.most_square).mean(axis=2)), out=best)
        return best

    def names(self, frames: Any, observed: Bool | None = None) -> list[str | None]:
        """Return the emotion of each frame (eq. 11), or None."""
        return [name for name, _ in self.certainties(frames, observed)]

    def certainties(self, frames: Any, observed: Bool | None = None) -> list[tuple[str | None, float]]:
        """Return the emotion of each frame, or None, and the greatest belief."""
        return [self._best(row) for row in self.beliefs(frames, observed)]

    def intervals(
        self, frames: Any, fps: float, observed: Bool | None = None, visible: Bool | None = None
    ) -> list[Interval]:
        """Return the intervals of emotions in FAP frames (n, 68).

        Frames are first averaged over a short window. An interval shorter than the window is merged into the
        one before it, or else after it, so that noise does not split an expression.

        Args:
            visible: (n,) whether the face was visible; other frames are in no interval.
        """
        if visible is not None:
            found, begin = [], 0
            for is_visible, run in groupby(visible.tolist()):
                end = begin + len(list(run))
                if is_visible:
                    parts = self.intervals(frames[begin:end], fps, observed)
                    found += [replace(p, start=p.start + begin / fps, end=p.end + begin / fps) for p in parts]
                begin = end
            return found
        values = np.asarray(frames, np.float64)
        window = min(max(round(self._model.window * fps), 1), len(values))
        before = window // 2
        padded = np.pad(values, ((before, window - 1 - before), (0, 0)), mode="edge")
        smooth = np.lib.stride_tricks.sliding_window_view(padded, window, axis=0).mean(axis=-1)
        runs: list[tuple[str | None, list[float]]] = []
        for name, run in groupby(self.certainties(smooth, observed), key=itemgetter(0)):
            beliefs = [belief for _, belief in run]
            if runs and (runs[-1][0] == name or len(beliefs) < window):
                runs[-1][1].extend(beliefs)
            else:
                runs.append((name, beliefs))
        if len(runs) > 1 and len(runs[0][1]) < window:
            _, first = runs.pop(0)
            runs[0][1][:0] = first
        ends = np.cumsum([len(beliefs) for _, beliefs in runs])
        return [
            Interval((end - len(beliefs)) / fps, end / fps, name, float(np.mean(beliefs)))
            for end, (name, beliefs) in zip(ends.tolist(), runs, strict=True)
        ]

    def _best(self, beliefs: Float64) -> tuple[str | None, float]:
        best = int(np.lexsort((self._count, beliefs))[-1])
        belief = float(beliefs[best])
        return (self._emotions[best] if belief >= self._model.least_belief else None), belief


@lru_cache(maxsize=8)
def recogniser(profiles: str = "own") -> Recogniser:
    """Return the recogniser of all profiles of a set, and of the neutral face.

    The set "own" has one profile per emotion, tried at several strengths, smiles that show the teeth, and the
    advanced emotions of the wheel.
    """
    every = [profile for numbered in archetypes(profiles).values() for profile in numbered.values()]
    if profiles == "own":
        blends = [emotion for emotion in ring("paul").values() if emotion.kind == "advanced"]
        every += [replace(wheel(emotion.angle), name=emotion.name) for emotion in blends]
        every += [_profile_of(f"joy {k}", units) for k, units in enumerate(emotion_model().smiles, 1)]
    strengths = emotion_model().strengths if profiles == "own" else (1.0,)
    return Recogniser([*every, Profile("neutral", profiles, {})], strengths)


def _profile_of(name: str, units: Mapping[int, float]) -> Profile:
    """Return the profile of action units, with ranges as wide as those of the set "own"."""
    row = au_row({(unit, "BOTH"): intensity for unit, intensity in units.items()})
    values = to_fap(AUFrames(np.zeros(1), row[None])).values[0].astype(np.float64)
    spread = emotion_model().spread * np.abs(values)
    ranges = zip(values, values - spread, values + spread, strict=True)
    moved = {
        fap: (float(a), float(b))
        for fap, (v, a, b) in enumerate(ranges, 1)
        if abs(v) >= emotion_model().least_length
    }
    return Profile(name, "own", moved)


def emotion_of(name: str) -> str:
    """Return the emotion of a profile: its name without the number."""
    return split_number(name)[0].lower()
