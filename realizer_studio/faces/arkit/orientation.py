"""Rotation, scale and centre of an imported head, computed from its blend shapes."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from realizer.core.array_types import Float64
from realizer.core.errors import FaceError
from realizer.tables.arkit_names import other_side
from realizer_studio.faces.arkit.mesh_merge import Surface

UNITS = {"metres": 1.0, "decimetres": 0.1, "centimetres": 0.01, "millimetres": 0.001, "inches": 0.0254}
EYE_DISTANCES = (0.048, 0.078)  # m; range for people from six years on
USUAL_EYE_DISTANCE = 0.062  # m
MIN_COSINE = np.cos(np.radians(20))  # a head that is nearer to the file's axes is aligned with them
SAME_PLACE = 1e-3  # of the head's size; nearer points are the same
UPPER = ("brow", "eye")
LOWER = ("mouth",)
# Shapes that show where the eyes are; the first that exists is used.
EYE_SHAPES = ("eyeBlink", "eyeSquint", "eyeWide", "cheekSquint", "browDown", "browOuterUp", "mouthSmile")


@dataclass(frozen=True)
class Pose:
    """The transformation of a file's head into the face folder's frame."""

    turn: Float64  # (3, 3) rotation of the file's axes
    scale: float  # metres of the file's unit
    middle: Float64  # (3,) point between the eyes, in the file's coordinates
    unit: str  # the name of the file's unit; "" if it is unknown
    swapped: bool  # whether its left shapes move the character's right side
    notes: tuple[str, ...]  # for the report
    unsure: tuple[str, ...]  # guesses that the user has to check


def pose_of(surface: Surface) -> Pose:
    """Return the pose of a head, computed from the vertices that its shapes move.

    Raises:
        FaceError: there is no shape of each eye, or shapes of different places move the same vertices.
    """
    centres = {name: surface.centre([move]) for name, move in surface.moves.items() if move.any()}
    pairs = [
        (centres[name], centres[name[:-4] + "Right"])
        for name in centres
        if name.endswith("Left") and len(name) > len("mouthLeft") and name[:-4] + "Right" in centres
    ]
    if _eyes(centres, False)[0] is None:
        raise FaceError(
            "wanted a shape of each eye, such as eyeBlinkLeft and eyeBlinkRight, got none: where the face is "
            "cannot be told; export the head with its ARKit shapes"
        )
    across = np.sum([a - b for a, b in pairs], axis=0) if pairs else np.zeros(3)
    high = [centre for name, centre in centres.items() if name.startswith(UPPER)]
    low = [centre for name, centre in centres.items() if name.startswith(LOWER)]
    notes, unsure = [], []
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
        notes.append(f"faces {_axis(turn[2])}, up is {_axis(turn[1])}")
    if swapped:
        notes.append("its shapes' left and right are the viewer's: exchanged")
    left, right = _eyes(centres, swapped)
    apart = float(np.linalg.norm((left - right) @ turn.T[:, :1]))
    if apart <= SAME_PLACE * np.ptp(surface.vertices, axis=0).max():
        raise _same_place("those of the left and the right eye")
    unit = next(
        (name for name, size in UNITS.items() if EYE_DISTANCES[0] <= apart * size <= EYE_DISTANCES[1]), ""
    )
    scale = UNITS[unit] if unit else USUAL_EYE_DISTANCE / apart
    if unit:
        notes.append(f"in {unit}: its eyes stand {apart * scale * 1000:.0f} mm apart")
    else:
        unsure.append(
            f"its eyes stand {apart:.4g} units apart, which no usual unit makes a head: scaled to "
            f"{USUAL_EYE_DISTANCE * 1000:.0f} mm"
        )
    return Pose(turn, scale, (left + right) / 2, unit, swapped, tuple(notes), tuple(unsure))


def oriented(surface: Surface, pose: Pose) -> Surface:
    """Return the surface in metres, origin between the eyes, +x the character's left, +y up, +z forward."""
    moves = {name: move @ pose.turn.T * pose.scale for name, move in surface.moves.items()}
    if pose.swapped:
        moves = {other_side(name): move for name, move in moves.items()}
    at = (surface.vertices - pose.middle) @ pose.turn.T * pose.scale
    return replace(surface, vertices=at, moves=moves)


def _eyes(centres: dict[str, Float64], swapped: bool) -> Any:
    for stem in EYE_SHAPES:
        if f"{stem}Left" in centres and f"{stem}Right" in centres:
            pair = centres[f"{stem}Left"], centres[f"{stem}Right"]
            return pair[::-1] if swapped else pair
    return None, None


def _same_place(shapes: str) -> FaceError:
    return FaceError(
        f"wanted shapes that move different places of the face, got {shapes} that move the same: where the "
        "face is cannot be told; export the head with its own ARKit shapes"
    )


def _turn(
    surface: Surface, across: Float64, up: Float64, centres: dict[str, Float64]
) -> tuple[Float64, bool]:
    least = SAME_PLACE * np.ptp(surface.vertices, axis=0).max()
    if np.linalg.norm(across) <= least:
        raise _same_place("left and right ones")
    x = across / np.linalg.norm(across)
    y = up - (up @ x) * x
    if np.linalg.norm(y) <= least:
        raise _same_place("those of eyes or brows and of the mouth")
    y /= np.linalg.norm(y)
    z = np.cross(x, y)
    # Moving vertices are in front of the head's centre at their height.
    face = np.mean(list(centres.values()), axis=0)
    level = np.abs((surface.vertices - face) @ y) < 1.5 * float(np.linalg.norm(up))
    middle = (surface.vertices[level].min(axis=0) + surface.vertices[level].max(axis=0)) / 2
    swapped = bool((face - middle) @ z < 0)
    return (np.stack([-x, y, -z]) if swapped else np.stack([x, y, z])), swapped


def _snapped(turn: Float64) -> Float64 | None:
    """Return the nearest of the 24 axis-aligned rotations, or None if none is near."""
    aligned = np.rint(Rotation.create_group("O").as_matrix()) + 0.0  # without negative zeros
    best: Float64 = max(aligned, key=lambda m: float(np.trace(m @ turn.T)))
    return best if min((best * turn).sum(axis=1)) > MIN_COSINE else None


def _axis(direction: Float64) -> str:
    k = int(np.argmax(np.abs(direction)))
    return f"{'-' if direction[k] < 0 else '+'}{'xyz'[k]}"
