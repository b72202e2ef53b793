"""A diverging colour scale that is safe for red-green colour blindness."""

import itertools
import math

PAPER = "#ffffff"
INK = "#1f2430"
FAINT = "#6b7280"
GRID = "#e6e8ec"
RIGID = "#d5dbe6"  # gaps that cannot be stretched
LINK = "#0f766e"  # links
HELD = "#1f2430"  # sync points that are fixed at a time
ROOM = "#7c6bb0"  # inequalities with slack
TIGHT = "#c2185b"  # active inequalities
LOST = "#9aa0aa"  # dropped behaviours

# (log3 of the stretch, colour): a third of the preferred length, the preferred length, three times it.
# From blue to orange, which differ for every kind of colour vision; both ends are dark in grey.
SCALE = (
    (-1.0, (33, 92, 168)),
    (-0.45, (128, 178, 226)),
    (0.0, (237, 235, 228)),
    (0.45, (246, 178, 107)),
    (1.0, (179, 84, 6)),
)


def colour_of(stretch: float) -> str:
    """Return the colour of a gap that is `stretch` times its preferred length; 0 and inf are the ends."""
    place = -1.0 if stretch <= 0 else min(1.0, max(-1.0, math.log(stretch) / math.log(3.0)))
    for (low, first), (high, last) in itertools.pairwise(SCALE):
        if place <= high:
            part = (place - low) / (high - low)
            mixed = (round(a + (b - a) * part) for a, b in zip(first, last, strict=True))
            return "#" + "".join(f"{channel:02x}" for channel in mixed)
    raise AssertionError(place)


def on(colour: str) -> str:
    """Return ink that is readable on a colour."""
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return INK if 0.299 * red + 0.587 * green + 0.114 * blue > 128 else "#ffffff"
