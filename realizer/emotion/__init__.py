"""What feelings look like: words and places on the wheel in, ranges of FAPs out, and back."""

from realizer.emotion.archetypes import archetypes
from realizer.emotion.intermediate import Anchor, between, same_category
from realizer.emotion.profile import Profile
from realizer.emotion.profile_file import read_profiles, write_profiles
from realizer.emotion.wheel import affect, shares, wheel

__all__ = [
    "Anchor",
    "Profile",
    "affect",
    "archetypes",
    "between",
    "read_profiles",
    "same_category",
    "shares",
    "wheel",
    "write_profiles",
]
