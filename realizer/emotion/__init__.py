"""What feelings look like: words and places on the wheel in, ranges of FAPs out, and back."""

from realizer.emotion.archetypes import archetypes
from realizer.emotion.intermediate import Anchor, between, same_category
from realizer.emotion.measure import (
    as_features_see,
    faps_from_features,
    faps_from_points,
    features_from_faps,
    features_from_points,
)
from realizer.emotion.profile import Profile
from realizer.emotion.profile_file import read_profiles, write_profiles
from realizer.emotion.recognise import Recogniser, Recognition, recogniser
from realizer.emotion.statistics import from_faces, from_statistics, published_statistics
from realizer.emotion.wheel import affect, place_of_affect, shares, strength_at, wheel
from realizer.emotion.words import UnknownWordError, WordPlace, emotion, known_words, place_of, strength_of

__all__ = [
    "Anchor",
    "Profile",
    "Recogniser",
    "Recognition",
    "UnknownWordError",
    "WordPlace",
    "affect",
    "archetypes",
    "as_features_see",
    "between",
    "emotion",
    "faps_from_features",
    "faps_from_points",
    "features_from_faps",
    "features_from_points",
    "from_faces",
    "from_statistics",
    "known_words",
    "place_of",
    "place_of_affect",
    "published_statistics",
    "read_profiles",
    "recogniser",
    "same_category",
    "shares",
    "strength_at",
    "strength_of",
    "wheel",
    "write_profiles",
]
