"""What feelings look like: words and places on the wheel in, ranges of FAPs out, and back."""

from realizer.emotion.archetypes import archetypes
from realizer.emotion.profile import Profile
from realizer.emotion.profile_file import read_profiles, write_profiles

__all__ = ["Profile", "archetypes", "read_profiles", "write_profiles"]
