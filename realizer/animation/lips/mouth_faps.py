"""The FAPs of lips, jaw and tongue that make a mouth shape."""

from realizer.animation.lips.visemes import SHAPE_COLUMNS, coarticulation
from realizer.core.array_types import Float64


def mouth_faps(mouth: Float64) -> dict[int, Float64]:
    """Return the values (n,), in FAPU, of all FAPs that speech moves.

    Args:
        mouth: (n, 10) float64, columns as `SHAPE_COLUMNS`.
    """
    contour = coarticulation()["contour"]
    part = {name: mouth[:, k] for k, name in enumerate(SHAPE_COLUMNS)}
    # In MPEG-4 FAPs of the upper lip move it down, those of the lower lip up: both are negative when open.
    upper, lower = -part["upper"], -part["lower"]
    values: dict[tuple[int, ...], Float64] = {
        (3,): part["jaw"].clip(0.0),  # FAP 3 has one direction
        (4,): upper,
        (5,): lower,
        (8, 9): upper * contour["side"],
        (10, 11): lower * contour["side"],
        (51,): upper * contour["outer"],
        (52,): lower * contour["outer"],
        (55, 56): upper * contour["outer_side"],
        (57, 58): lower * contour["outer_side"],
        (6, 7, 53, 54): part["width"],
        (12, 13, 59, 60): part["corner"],
        (16,): part["push_lower"],
        (17,): part["push_upper"],
        (44,): part["tip"],
        (45,): part["thrust"],
        (46,): part["body"],
    }
    return {number: value for numbers, value in values.items() for number in numbers}
