"""Profiles for emotion words."""

from collections.abc import Mapping
from functools import cache
from types import MappingProxyType
from typing import NamedTuple

from realizer.core.similar import did_you_mean, similar
from realizer.emotions.archetypes import archetypes, is_profile_file, split_set
from realizer.emotions.profile import Profile, split_number
from realizer.emotions.wheel import NEUTRAL, between, blend_weights, neighbours, wheel
from realizer.tables.emotions import own_words, ring, whissell_words


class WordPlace(NamedTuple):
    """A place on a ring of the wheel."""

    ring: str
    angle: float
    # None for an emotion of the wheel itself, which has the activation of its archetypes.
    activation: float | None = None
    # Whether the word belongs to no archetype, so that published profiles are interpolated.
    between: bool = False
    strength: float = 1.0  # factor of a word that is a milder or stronger form of another one


class UnknownWordError(ValueError):
    """An unknown emotion word; the text lists similar ones."""


def emotion(word: str, profiles: str = "own") -> Profile:
    """Return the profile of a word:

    - an emotion on the wheel of Paul 2010 ("anger", "remorse"), or "neutral";
    - a word rated by Whissell ("terrified", "guilty"): the archetype of its category, scaled by the ratio of
      the activations, or a blend of the two archetypes around its angle: by the published rules for
      published profiles, by `wheel` and `strength_of` for our own;
    - a word of our own list, which stands for another word or is a degree of it ("serenity" of "joy");
    - an archetype and a number ("fear 8"), or any emotion of a profile file.

    Args:
        word: in any case.
        profiles: a set of `archetypes`.

    Raises:
        UnknownWordError: an unknown word or number.
        ValueError: an unknown set, or "accepting", which has no activation.
    """
    word = " ".join(word.split()).lower()
    known = archetypes(profiles)
    name, number = split_number(word)
    if number is not None:
        if number in known.get(name, {}):
            return known[name][number]
        raise UnknownWordError(_unknown_profile(name, number, profiles))
    if is_profile_file(split_set(profiles)[0]):
        if word in known:
            return next(iter(known[word].values()))
        if word in ring("paul") and ring("paul")[word].kind == "basic":
            raise UnknownWordError(f"emotion: wanted one of {', '.join(known)} of {profiles}, got {word!r}")
    place = place_of(word)
    if place is None:
        return Profile(word, profiles, {})
    if place.between and profiles != "own" and place.activation is not None:
        (one, _), (two, _) = neighbours(place.angle, profiles, place.ring)
        return between(one, two, place.angle, place.activation, word)
    if profiles == "own":
        full = wheel(place.angle, None, profiles, place.ring)
        return full.scaled(strength_of(place), word)
    return wheel(place.angle, place.activation, profiles, place.ring).scaled(place.strength, word)


def strength_of(place: WordPlace) -> float:
    """Return the strength of our own archetypes for a word; 1 is full.

    Ratings by Whissell are relative to the archetypes around the word, so that "terrified" is stronger than
    "afraid", and "afraid" as strong as "fear".
    """
    if place.activation is None:
        return place.strength
    parts = blend_weights(place.angle, "own", place.ring)
    return (
        place.strength
        * place.activation
        / sum(share * (ring(place.ring)[name].activation or 0.0) for name, share in parts.items())
    )


def place_of(word: str, profiles: str = "own") -> WordPlace | None:
    """Return the place of a word on the wheel, or None for the neutral face.

    A profile such as "fear 8" has the place of its archetype.

    Raises:
        UnknownWordError, ValueError: as for `emotion`.
    """
    word = " ".join(word.split()).lower()
    name, number = split_number(word)
    if number is not None:
        if number not in archetypes(profiles).get(name, {}):
            raise UnknownWordError(_unknown_profile(name, number, profiles))
        word = name
    own = own_words().get(word)
    meant, strength = (word, 1.0) if own is None else (own.like, own.strength)
    if meant == NEUTRAL:
        return None
    if meant in ring("paul"):
        return WordPlace("paul", ring("paul")[meant].angle, strength=strength)
    row = whissell_words().get(meant)
    if row is None:
        raise UnknownWordError(_unknown(word))
    if row.activation is None:
        raise ValueError(f"{row.word}: its activation was never rated, so it has no face of its own")
    if row.category:
        return WordPlace("plutchik", ring("plutchik")[row.category].angle, row.activation, strength=strength)
    return WordPlace("plutchik", row.angle, row.activation, between=True)


@cache
def known_words() -> Mapping[str, str]:
    """Return word -> source ("wheel", "whissell" or "own") of every word with a profile."""
    found = dict.fromkeys([NEUTRAL, *ring("paul")], "wheel")
    found |= {row.word: "whissell" for row in whissell_words().values() if row.activation is not None}
    found |= dict.fromkeys(own_words(), "own")
    return MappingProxyType(found)


def _unknown_profile(name: str, number: int, profiles: str) -> str:
    """Return the message for an unknown profile of a set."""
    known = archetypes(profiles)
    if name not in known:
        every = [f"{other} {k}" for other, numbered in known.items() for k in numbered]
        hint = did_you_mean(similar(f"{name} {number}", every)) or f"; there are {', '.join(known)}"
        return f"emotion: wanted a profile of the {profiles} ones, got '{name[:60]} {number}'{hint}"
    numbers = sorted(known[name])
    has = f"{name} {numbers[0]}" + (f" to {name} {numbers[-1]}" if len(numbers) > 1 else "")
    message = f"emotion: wanted {has} of the {profiles} profiles, got '{name} {number}'"
    if number in archetypes("published").get(name, {}):
        return f"{message}; the published profiles have it"
    return f"{message}, did you mean {name} {min(numbers, key=lambda k: abs(k - number))}?"


def _unknown(word: str) -> str:
    got = repr(word if len(word) <= 60 else word[:60] + "...")
    if hint := did_you_mean(similar(word, known_words())):
        return f"emotion: wanted a known word, got {got}{hint}"
    return f"emotion: wanted one of {', '.join(sorted(known_words()))}; got {got}"
