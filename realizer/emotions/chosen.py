"""The profile of an emotion that is given as a word or as a place: `realizer.emotion`."""

from collections.abc import Mapping

from realizer.emotions.profile import Profile
from realizer.emotions.wheel import affect, blend_weights, place_of_affect, wheel
from realizer.emotions.words import emotion as profile_of


def emotion(
    word: str | None = None,
    *,
    angle: float | None = None,
    activation: float | None = None,
    valence: float | None = None,
    arousal: float | None = None,
    profiles: str = "own",
) -> Profile:
    """Return the FAPs of an emotion as ranges; its method `frame` returns their middles, (68,).

    Args:
        word: such as "joy" or "guilty".
        angle: degrees on the wheel of Paul 2010; activation: with it, 0 (neutral) to 7 (full).
        valence, arousal: -1..1, both.
        profiles: "own", or those of Raouzaiou et al. 2002: "published" (corrected) or "raw" (as printed);
            or the path of a profile file, FILE.txt. "published, fear 3" has fear 3 stand for fear.

    Raises:
        TypeError: a value has another type.
        ValueError: an unknown word, a number out of its range, or none or several places.
    """
    return emotion_and_shares(word, angle, activation, (valence, arousal), profiles)[0]


def emotion_and_shares(
    word: str | None,
    angle: float | None,
    activation: float | None,
    affects: tuple[float | None, float | None],
    profiles: str,
) -> tuple[Profile, Mapping[str, float]]:
    """Return the profile of `emotion`, and archetype -> share at a place; `affects`: valence, arousal."""
    valence, arousal = affects
    numbers = {"angle": angle, "activation": activation, "valence": valence, "arousal": arousal}
    for name, value in numbers.items():
        if value is not None and (isinstance(value, bool) or not isinstance(value, int | float)):
            raise TypeError(f"{name}: wanted a number, got {value!r}")
    if word is not None and not isinstance(word, str):
        raise TypeError(f"word: wanted a word such as joy, got {word!r}")
    if (valence is None) != (arousal is None):
        raise ValueError("wanted valence and arousal together, got one of them")
    if activation is not None and angle is None:
        raise ValueError("wanted an angle with the activation, got it alone")
    if sum(value is not None for value in (word, angle, valence)) != 1:
        raise ValueError("wanted one of a word, an angle, or valence with arousal")
    if angle is not None:
        return wheel(angle, activation, profiles), blend_weights(angle, profiles)
    if valence is not None and arousal is not None:
        degrees, _ = place_of_affect(valence, arousal)
        return affect(valence, arousal, profiles), blend_weights(degrees, profiles, "affect")
    return profile_of(word or "", profiles), {}
