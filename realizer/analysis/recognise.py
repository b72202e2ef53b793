"""Fuzzy recognition of emotions from FAPs (Raouzaiou et al. 2002, section 5)."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float64
from realizer.emotions.archetypes import archetypes
from realizer.emotions.profile import Profile
from realizer.emotions.wheel import wheel
from realizer.tables.emotion_model import emotion_model
from realizer.tables.wheel_words import ring


@dataclass(frozen=True)
class Recognition:
    """The result of a recognition.

    Attributes:
        emotion: emotion with the greatest belief (eq. 11); None if all are 0.
        emotions: emotion -> belief 0..1 (eq. 9).
        profiles: profile -> belief (eq. 8).
    """

    emotion: str | None
    emotions: Mapping[str, float]
    profiles: Mapping[str, float]


class Recogniser:
    """Recognises profiles and emotions in FAP frames by fuzzy classes.

    The membership of a value depends on its distance from the range of the FAP (`tables/emotion_model.toml`;
    the shape of figure 6 is not in the text). The belief in a profile is the product over its FAPs, the
    belief in an emotion that of its best profile. Of equal beliefs, the profile with more FAPs has priority.
    """

    def __init__(
        self, profiles: Iterable[Profile], absent: bool = True, strengths: Sequence[float] = (1.0,)
    ) -> None:
        """
        Args:
            profiles: at least one; the emotion is the name without the number.
            absent: whether FAPs that only other profiles move must be near 0; without it (as published), a
                profile with few FAPs is recognised wherever a larger one is.
            strengths: factors of the profiles to try; the best one counts.
        """
        self.profiles = tuple(profiles)
        if not self.profiles:
            raise ValueError("profiles: wanted at least one, got none")
        model = emotion_model()
        shape = (len(self.profiles), 68)
        self._middle, self._length = np.zeros(shape), np.full(shape, 2 * model.absent)
        self._used = np.zeros(shape, bool)
        for k, profile in enumerate(self.profiles):
            for fap, (low, high) in profile.ranges.items():
                self._middle[k, fap - 1] = (low + high) / 2
                self._length[k, fap - 1] = high - low
                self._used[k, fap - 1] = True
        self._moving = self._used.copy()
        self._moved = self._used.sum(axis=1)
        self._classes = [self._class(strength, model.least_length) for strength in strengths]
        if absent:
            self._used |= self._used.any(axis=0)
        self._core, self._base = model.core, model.base
        self._emotions = [_emotion(profile.name) for profile in self.profiles]

    def beliefs(self, frames: Any, seen: Bool | None = None) -> Float64:
        """Return the beliefs (n, profiles) in FAP frames (n, 68).

        Args:
            seen: (68,) which FAPs were observed; None: all.

        Raises:
            ValueError: frames of another shape, or values that are not finite.
        """
        values = np.asarray(frames, np.float64)
        if values.ndim != 2 or values.shape[1] != 68:
            raise ValueError(f"frames: wanted (n, 68), got {values.shape}")
        if not np.isfinite(values).all():
            raise ValueError("frames: wanted finite values, got NaN or infinity")
        judged = self._used if seen is None else self._used & seen
        best: Float64 = np.zeros((len(values), len(self.profiles)))
        for middle, half in self._classes:
            away = np.abs(values[:, None] - middle) / half
            membership = np.clip((self._base - away) / (self._base - self._core), 0.0, 1.0)
            np.maximum(best, np.where(judged, membership, 1.0).prod(axis=2), out=best)
        # Profiles need at least one observed FAP.
        return best * judged.any(axis=1)

    def names(self, frames: Any, seen: Bool | None = None) -> list[str | None]:
        """Return the emotion of each frame (eq. 11), or None."""
        return [self._best(row) for row in self.beliefs(frames, seen)]

    def recognise(self, frame: Any, seen: Bool | None = None) -> Recognition:
        """Recognise one FAP frame (68,)."""
        beliefs = self.beliefs(np.asarray(frame)[None], seen)[0]
        emotions: dict[str, float] = {}
        for emotion, belief in zip(self._emotions, beliefs, strict=True):
            emotions[emotion] = max(emotions.get(emotion, 0.0), float(belief))
        names = (profile.name for profile in self.profiles)
        return Recognition(self._best(beliefs), emotions, dict(zip(names, map(float, beliefs), strict=True)))

    def _class(self, strength: float, least: float) -> tuple[Float64, Float64]:
        """Return the middles of the classes and half of their lengths, (profiles, 68) each."""
        length = np.where(self._moving, np.maximum(self._length * strength, least), self._length)
        return self._middle * strength, length / 2

    def _best(self, beliefs: Float64) -> str | None:
        best = int(np.lexsort((self._moved, beliefs))[-1])
        return self._emotions[best] if beliefs[best] > 0 else None


def recogniser(profiles: str = "own", absent: bool = True) -> Recogniser:
    """Return the recogniser of all profiles of a set: "own", "published" or "raw".

    With `absent`, the neutral face can be recognised too. Our own set has one profile per emotion, tried at
    several strengths, and includes the advanced emotions of the wheel.
    """
    strengths = emotion_model().strengths if profiles == "own" else (1.0,)
    every = [profile for numbered in archetypes(profiles).values() for profile in numbered.values()]
    if profiles == "own":
        blends = [place for place in ring("paul").values() if place.kind == "advanced"]
        every += [replace(wheel(place.angle), name=place.name) for place in blends]
    return Recogniser([*every, Profile("neutral", profiles, {})] if absent else every, absent, strengths)


def _emotion(name: str) -> str:
    emotion, _, number = name.rpartition(" ")
    return emotion if emotion and number.isdecimal() else name
