"""Reader and writer for profile files in the format of Paul (2010, 6.3)."""

from collections.abc import Iterable

from realizer.emotions.profile import Profile


def read_profiles(text: str, where: str = "profiles") -> tuple[Profile, ...]:
    """Parse the profiles of a file: each is a line with an emotion and a number, and a line of ranges.

    Empty lines and lines that begin with # are ignored.

    Args:
        where: name of the file in messages.

    Raises:
        ValueError: an invalid line; the text names it.
    """
    found: dict[str, Profile] = {}
    label = ""
    for number, line in enumerate(text.splitlines(), 1):
        if not (line := line.strip()) or line.startswith("#"):
            continue
        if label:
            try:
                found[label] = Profile.parse(line, label, where)
            except ValueError as error:
                raise ValueError(f"{where}, line {number}: {error}") from None
            label = ""
            continue
        emotion, _, index = line.rpartition(" ")
        if not emotion.strip() or not index.isdecimal():
            raise ValueError(f"{where}, line {number}: wanted an emotion and a number, got {line[:60]!r}")
        label = f"{emotion.strip()} {int(index)}"
        if label in found:
            raise ValueError(f"{where}, line {number}: {label} is there twice")
    if label:
        raise ValueError(f"{where}: wanted a line of ranges after {label!r}, got the end")
    return tuple(found.values())


def write_profiles(profiles: Iterable[Profile]) -> str:
    """Return the text of a profile file; a profile without a number gets 0."""
    lines = []
    for profile in profiles:
        numbered = profile.name.rpartition(" ")[2].isdecimal() and " " in profile.name
        label = profile.name if numbered else f"{profile.name} 0"
        lines += [label[:1].upper() + label[1:], str(profile)]
    return "\n".join(lines) + "\n"
