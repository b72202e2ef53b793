"""The profiles of the archetypal emotions: our own, published, as printed, or of a file."""

from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path

from realizer.emotions.profile import Profile, read_profiles, split_number
from realizer.tables.emotions import PublishedRange, emotion_model, own_ranges, published_ranges

SETS = ("own", "published", "raw")


@lru_cache(maxsize=64)
def archetypes(profiles: str = "own") -> Mapping[str, Mapping[int, Profile]]:
    """Return emotion -> number -> profile; the first profile of an emotion is the one that stands for it.

    Args:
        profiles: "own"; "published", those of Raouzaiou et al. 2002, table 5, corrected; "raw", as printed;
            or the path of a profile file, FILE.txt, which is read once. Profiles after commas stand for
            their emotions: "published, fear 3, joy 0".

    Raises:
        ValueError: an unknown set or profile, or a file that cannot be read.
    """
    name, chosen = split_set(profiles)
    found: dict[str, dict[int, Profile]] = {}
    for profile in _profiles_of(name):
        emotion, _, digits = profile.name.lower().rpartition(" ")
        found.setdefault(emotion, {})[int(digits)] = profile
    usual = emotion_model().chosen if name in ("published", "raw") else {}
    for emotion, number in [*usual.items(), *chosen.items()]:
        numbered = found.get(emotion, {})
        if number not in numbered:
            known = ", ".join(profile.name for every in found.values() for profile in every.values())
            raise ValueError(f"profiles: wanted one of {known}; got '{emotion[:60]} {number}'")
        found[emotion] = {number: numbered[number]} | numbered
    return found


def split_set(profiles: str) -> tuple[str, dict[str, int]]:
    """Return the name of a set, and the profiles chosen after it: "raw, fear 3" is "raw", {"fear": 3}."""
    name, *parts = profiles.split(",")
    chosen: dict[str, int] = {}
    while parts:
        emotion, number = split_number(parts[-1].strip())
        if number is None:
            break
        chosen.setdefault(emotion.strip().lower(), number)
        parts.pop()
    return ",".join([name, *parts]).strip(), chosen


def is_profile_file(name: str) -> bool:
    """Return whether the name of a set is that of a profile file."""
    return name.lower().endswith(".txt")


def read_profile_file(path: Path) -> tuple[Profile, ...]:
    """Return the profiles of a file; raises ValueError: a file that cannot be read, or has no profiles."""
    try:
        found = read_profiles(path.read_text("utf-8-sig"), str(path))
    except UnicodeDecodeError as error:
        raise ValueError(f"{path}: wanted a text in UTF-8, got: {error.reason} at {error.start}") from None
    except OSError as error:
        raise ValueError(f"{path}: wanted a file of profiles, got: {error.strerror}") from None
    if not found:
        raise ValueError(f"{path}: wanted at least one profile, got none")
    return found


def _profiles_of(name: str) -> tuple[Profile, ...]:
    if is_profile_file(name):
        return read_profile_file(Path(name))
    if name not in SETS:
        raise ValueError(f"profiles: wanted {', '.join(SETS)} or a file FILE.txt, got {name[:60]!r}")
    ranges: dict[tuple[str, int], dict[int, tuple[float, float]]] = {}
    for row in own_ranges() if name == "own" else published_ranges():
        ends = row.low, row.high
        if isinstance(row, PublishedRange) and name == "raw":
            ends = row.raw_low, row.raw_high
        # Some ranges are printed backwards.
        ranges.setdefault((row.emotion, row.profile), {})[row.fap] = min(ends), max(ends)
    return tuple(Profile(f"{emotion} {number}", name, faps) for (emotion, number), faps in ranges.items())
