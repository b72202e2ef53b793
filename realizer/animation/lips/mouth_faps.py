"""The FAPs of lips, jaw and tongue that make a mouth shape."""

import math

from realizer.animation.lips.visemes import SHAPE_COLUMNS, coarticulation
from realizer.core.array_types import Float64

ROLL = 1e5 * math.pi / 180  # units of FAP 47 in a degree


def mouth_faps(mouth: Float64) -> dict[int, Float64]:
    """Return the values (n,), in FAPU, of all FAPs that speech moves.

    Args:
        mouth: (n, 11) float64, columns as `SHAPE_COLUMNS`.
    """
    contour, pressure = coarticulation()["contour"], coarticulation()["pressure"]
    part = {name: mouth[:, k] for k, name in enumerate(SHAPE_COLUMNS)}
    # In MPEG-4 FAPs of the upper lip move it down, those of the lower lip up: both are negative when open.
    upper, lower = -part["upper"], -part["lower"]
    # The outer contours of lips that press against each other approach, and both lips roll in; those of
    # parted lips that are pushed forward turn out.
    pressed = (upper + lower).clip(0.0)
    thinner, inwards = pressed * pressure["outer"], pressed * pressure["inwards"]
    flare = contour["flare"] * (-(upper + lower) / contour["parted"]).clip(0.0, 1.0)
    upper_out = thinner - part["push_upper"].clip(0.0) * flare
    lower_out = thinner - part["push_lower"].clip(0.0) * flare
    values: dict[tuple[int, ...], Float64] = {
        (3,): part["jaw"].clip(0.0),  # FAP 3 has one direction
        (4,): upper,
        (5,): lower,
        (8, 9): upper * contour["side"],
        (10, 11): lower * contour["side"],
        (51,): upper * contour["outer"] + upper_out,
        (52,): lower * contour["outer"] + lower_out,
        (55, 56): upper * contour["outer_side"] + upper_out,
        (57, 58): lower * contour["outer_side"] + lower_out,
        (6, 7, 53, 54): part["width"],
        (12, 13, 59, 60): part["corner"],
        (16,): part["push_lower"] - inwards,
        (17,): part["push_upper"] - inwards,
        (44,): part["tip"],
        (45,): part["thrust"],
        (46,): part["body"],
        (47,): part["roll"].clip(0.0) * ROLL,  # FAP 47 has one direction too
    }
    return {number: value for numbers, value in values.items() for number in numbers}
