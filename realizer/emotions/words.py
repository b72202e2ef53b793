"""Profiles of words for emotions."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from types import MappingProxyType
from typing import NamedTuple

from realizer.emotions.archetypes import archetypes
from realizer.emotions.intermediate import between
from realizer.emotions.profile import Profile
from realizer.emotions.wheel import NEUTRAL, blend_weights, neighbours, wheel
from realizer.tables.wheel_words import own_words, ring, whissell_words


class WordPlace(NamedTuple):
    """A place on a ring of the wheel.

    `activation` is None for an emotion of the wheel itself: as much as its archetypes. `between`: no
    archetype is of its kind, and the published rules for what lies between two hold.
    """

    ring: str
    angle: float
    activation: float | None = None
    between: bool = False


class UnknownWordError(ValueError):
    """A word for no emotion that is known; the text says which ones are near it."""


def emotion(word: str, profiles: str = "own") -> Profile:
    """The profile of a word.

    - An emotion of the wheel of Paul 2010 ("anger", "remorse"), and "neutral": as its archetypes themselves.
    - A word that Whissell rated ("terrified", "guilty"): of the kind of an archetype, as their activations
      are to each other; else what lies between two archetypes at its angle. There the published sets go by
      the published rules, our own by the wheel, which has no jumps. Ours is as strong beside its archetypes
      as the word is beside theirs (`strength_of`).
    - A word of our own list: as the one that it is like.
    - An archetype and a number ("fear 8"): that profile itself.

    Args:
        word: either case.
        profiles: "own", "published" or "raw".

    Raises:
        UnknownWordError: none of those, or a number that the archetype does not have.
        ValueError: another set, or "accepting", which has no activation.
    """
    asked = " ".join(word.split()).lower()
    known = archetypes(profiles)
    name, number = _numbered(asked)
    if number is not None:
        if number in known.get(name, {}):
            return known[name][number]
        raise UnknownWordError(_unknown_profile(name, number, profiles))
    place = place_of(asked)
    if place is None:
        return Profile(asked, profiles, {})
    if place.between and profiles != "own" and place.activation is not None:
        (one, _), (two, _) = neighbours(place.angle, profiles, place.ring)
        return between(one, two, place.angle, place.activation, asked)
    if profiles == "own":
        full = wheel(place.angle, None, profiles, place.ring)
        return full.scaled(strength_of(place), asked)
    return replace(wheel(place.angle, place.activation, profiles, place.ring), name=asked)


def strength_of(place: WordPlace) -> float:
    """Return the strength of our own archetypes for a word: 1 is full.

    A word is a kind of face: what Whissell rated counts beside its neighbours on Plutchik's ring, so that
    terrified is more than afraid, and afraid as much as fear.
    """
    if place.activation is None:
        return 1.0
    parts = blend_weights(place.angle, "own", place.ring)
    return place.activation / sum(
        share * (ring(place.ring)[name].activation or 0.0) for name, share in parts.items()
    )


def place_of(word: str, profiles: str = "own") -> WordPlace | None:
    """Return a word's place on the wheel, or None for the neutral face.

    An archetype and the number of one of its profiles in that set is where the archetype is.

    Raises:
        UnknownWordError, ValueError: as `emotion`.
    """
    asked = " ".join(word.split()).lower()
    name, number = _numbered(asked)
    if number is not None:
        if number not in archetypes(profiles).get(name, {}):
            raise UnknownWordError(_unknown_profile(name, number, profiles))
        asked = name
    meant = own_words()[asked].like if asked in own_words() else asked
    if meant == NEUTRAL:
        return None
    if meant in ring("paul"):
        return WordPlace("paul", ring("paul")[meant].angle)
    row = whissell_words().get(meant)
    if row is None:
        raise UnknownWordError(_unknown(asked))
    if row.activation is None:
        raise ValueError(f"{row.word}: nobody rated how activated it is, so it has no face of its own")
    if row.category:
        return WordPlace("plutchik", ring("plutchik")[row.category].angle, row.activation)
    return WordPlace("plutchik", row.angle, row.activation, between=True)


@cache
def known_words() -> Mapping[str, str]:
    """Return word -> its source, "wheel", "whissell" or "own", for every word with a profile."""
    found = dict.fromkeys([NEUTRAL, *ring("paul")], "wheel")
    found |= {row.word: "whissell" for row in whissell_words().values() if row.activation is not None}
    found |= dict.fromkeys(own_words(), "own")
    return MappingProxyType(found)


def _numbered(asked: str) -> tuple[str, int | None]:
    """ "fear 8" -> "fear", 8; a word without a number -> itself, None."""
    name, _, number = asked.rpartition(" ")
    return (name, int(number)) if name and number.isdecimal() and len(number) < 10 else (asked, None)


def _unknown_profile(name: str, number: int, profiles: str) -> str:
    """Of the profiles of a set, which ones there are, and which one was probably meant."""
    known = archetypes(profiles)
    if name not in known:
        every = [f"{other} {k}" for other, numbered in known.items() for k in numbered]
        near = difflib.get_close_matches(f"{name} {number}", every, n=3)
        hint = f", did you mean {' or '.join(near)}?" if near else f"; there are {', '.join(known)}"
        return f"emotion: wanted a profile of the {profiles} ones, got '{name[:60]} {number}'{hint}"
    numbers = sorted(known[name])
    has = f"{name} {numbers[0]}" + (f" to {name} {numbers[-1]}" if len(numbers) > 1 else "")
    said = f"emotion: wanted {has} of the {profiles} profiles, got '{name} {number}'"
    if number in archetypes("published").get(name, {}):
        return f"{said}; the published profiles have it"
    return f"{said}, did you mean {name} {min(numbers, key=lambda k: abs(k - number))}?"


def _unknown(word: str) -> str:
    near = difflib.get_close_matches(word, list(known_words()), n=3)
    got = repr(word if len(word) <= 60 else word[:60] + "...")
    if near:
        return f"emotion: wanted a word that is known, got {got}, did you mean {' or '.join(near)}?"
    return f"emotion: wanted one of {', '.join(sorted(known_words()))}; got {got}"
