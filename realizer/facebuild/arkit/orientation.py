"""Rotation, scale and centre of an imported head, found from what its shapes move."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer.facebuild.arkit.mesh_merge import Surface
from realizer.tables.arkit_names import other_side

UNITS = {"metres": 1.0, "decimetres": 0.1, "centimetres": 0.01, "millimetres": 0.001, "inches": 0.0254}
EYES = (0.048, 0.078)  # m between the eyes of people from six years on
USUAL = 0.062  # m
SNAP = np.cos(np.radians(20))  # a head this close to the file's axes is aligned with them
UPPER = ("brow", "eye")
LOWER = ("mouth",)
# Without a blink, another shape of the eyes is used.
AT_EYES = ("eyeBlink", "eyeSquint", "eyeWide", "cheekSquint", "browDown", "browOuterUp", "mouthSmile")


@dataclass(frozen=True)
class Pose:
    """The transformation of a file's head into the face folder's frame.

    Attributes:
        turn: (3, 3) rotation of the file's directions; scale: metres of the file's unit; middle: (3,) in
            the file's frame, between the eyes.
        unit: the name of the file's unit; "" where none fits.
        swapped: its left shapes move the character's right side.
        words: how it was found; unsure: guesses to check by eye.
    """

    turn: Float64
    scale: float
    middle: Float64
    unit: str
    swapped: bool
    words: tuple[str, ...]
    unsure: tuple[str, ...]


def pose_of(surface: Surface) -> Pose:
    """Return the orientation, found from left and right shapes, eyes, mouth and the side of the face.

    Raises:
        FaceError: no shape moves anything that has a side.
    """
    centres = {name: surface.centre([move]) for name, move in surface.moves.items() if move.any()}
    pairs = [
        (centres[name], centres[name[:-4] + "Right"])
        for name in centres
        if name.endswith("Left") and len(name) > len("mouthLeft") and name[:-4] + "Right" in centres
    ]
    across = np.sum([a - b for a, b in pairs], axis=0) if pairs else np.zeros(3)
    high = [place for name, place in centres.items() if name.startswith(UPPER)]
    low = [place for name, place in centres.items() if name.startswith(LOWER)]
    words, unsure = [], []
    if not pairs or not high or not low:
        missing = "of two sides" if not pairs else "of eyes or brows" if not high else "of the mouth"
        unsure.append(f"no shapes {missing}: taken to stand as glTF asks, +y up and facing +z")
        turn, swapped = np.eye(3), False
    else:
        turn, swapped = _turn(surface, across, np.mean(high, axis=0) - np.mean(low, axis=0), centres)
        snapped = _snapped(turn)
        if snapped is None:
            unsure.append("the head does not stand along the file's axes: turned by its shapes, look at it")
        else:
            turn = snapped
        words.append(f"faces {_axis(turn[2])}, up is {_axis(turn[1])}")
    if swapped:
        words.append("its shapes' left and right are the viewer's: exchanged")
    left, right = _eyes(centres, swapped)
    apart = float(np.linalg.norm((left - right) @ turn.T[:, :1])) if left is not None else 0.0
    if left is None or apart <= 0:
        raise FaceError(
            "wanted a shape of each eye, such as eyeBlinkLeft and eyeBlinkRight, got none: where the face is "
            "cannot be told; export the head with its ARKit shapes"
        )
    unit = next((name for name, size in UNITS.items() if EYES[0] <= apart * size <= EYES[1]), "")
    scale = UNITS[unit] if unit else USUAL / apart
    if unit:
        words.append(f"in {unit}: its eyes stand {apart * scale * 1000:.0f} mm apart")
    else:
        unsure.append(
            f"its eyes stand {apart:.4g} units apart, which no usual unit makes a head: scaled to "
            f"{USUAL * 1000:.0f} mm"
        )
    return Pose(turn, scale, (left + right) / 2, unit, swapped, tuple(words), tuple(unsure))


def oriented(surface: Surface, pose: Pose) -> Surface:
    """Return the surface in metres, origin between the eyes, +x the character's left, +y up, +z forward."""
    moves = {name: move @ pose.turn.T * pose.scale for name, move in surface.moves.items()}
    if pose.swapped:
        moves = {other_side(name): move for name, move in moves.items()}
    at = (surface.vertices - pose.middle) @ pose.turn.T * pose.scale
    return replace(surface, vertices=at, moves=moves)


def _eyes(centres: dict[str, Float64], swapped: bool) -> Any:
    for stem in AT_EYES:
        if f"{stem}Left" in centres and f"{stem}Right" in centres:
            pair = centres[f"{stem}Left"], centres[f"{stem}Right"]
            return pair[::-1] if swapped else pair
    return None, None


def _turn(
    surface: Surface, across: Float64, up: Float64, centres: dict[str, Float64]
) -> tuple[Float64, bool]:
    x = across / np.linalg.norm(across)
    y = up - (up @ x) * x
    y /= np.linalg.norm(y)
    z = np.cross(x, y)
    # The face is on the front of the head: moving vertices lie before the middle of their level.
    face = np.mean(list(centres.values()), axis=0)
    level = np.abs((surface.vertices - face) @ y) < 1.5 * float(np.linalg.norm(up))
    middle = (surface.vertices[level].min(axis=0) + surface.vertices[level].max(axis=0)) / 2
    swapped = bool((face - middle) @ z < 0)
    return (np.stack([-x, y, -z]) if swapped else np.stack([x, y, z])), swapped


def _snapped(turn: Float64) -> Float64 | None:
    """Return the nearest of the 24 axis-aligned rotations, or None if it is far."""
    from scipy.spatial.transform import Rotation

    aligned = np.rint(Rotation.create_group("O").as_matrix()) + 0.0  # without zeros below zero
    best: Float64 = max(aligned, key=lambda m: float(np.trace(m @ turn.T)))
    return best if min((best * turn).sum(axis=1)) > SNAP else None


def _axis(way: Float64) -> str:
    k = int(np.argmax(np.abs(way)))
    return f"{'-' if way[k] < 0 else '+'}{'xyz'[k]}"
