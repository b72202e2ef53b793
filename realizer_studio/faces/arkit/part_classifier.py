"""A classifier of a mesh's parts, by names and by blend shapes."""

import re
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np

from realizer.core.array_types import Bool, Float64
from realizer.core.errors import FaceError
from realizer.face.mesh_geometry import fit_ball
from realizer_studio.faces.arkit.mesh_merge import Surface, part_of

ROUND = 0.06  # of its radius: the largest distance of an eyeball's vertices from the fitted ball
BALL = (0.006, 0.022)  # m, radii of eyeballs
EYEBALL = 0.012  # m, the radius of people's eyes
AT_EYE = 0.016  # m; the largest height of an eyeball's centre relative to where the lids close
USUAL_MOUTH = np.array([0.0, -0.072, 0.028])  # m; of a head without shapes
FLOOR, HALF_WIDTH = -0.31, 0.24  # m; lower end and half width of the bust
LOOKS = ("eyeLookDown", "eyeLookUp", "eyeLookIn", "eyeLookOut")
ORDER = (
    "skin", "brows", "lashes", "left_eye", "right_eye", "upper_teeth", "lower_teeth", "tongue", "beard",
    "hair", "shirt", "other",
)  # fmt: skip


@dataclass(frozen=True)
class HeadParts:
    """The vertices of the parts of a head."""

    parts: dict[str, Any]  # name -> (k,) vertices, in the order of the face folder
    painted: bool  # whether the eyes are part of the skin's mesh
    notes: tuple[str, ...]  # for the report
    unsure: tuple[str, ...]  # guesses to check by eye

    def arranged(self, surface: Surface) -> tuple[Surface, dict[str, tuple[int, int]]]:
        """Return the surface with its vertices ordered by part, and each part's first vertex and last + 1."""
        ends = np.cumsum([0] + [len(index) for index in self.parts.values()]).tolist()
        reordered = surface.subset(np.concatenate(list(self.parts.values())))
        return reordered, dict(zip(self.parts, pairwise(ends), strict=True))


def sort_parts(surface: Surface) -> HeadParts:
    """Return the parts of an upright head in metres with its origin between the eyes.

    Without shapes, the largest piece is the skin.

    Raises:
        FaceError: no skin that the shapes move, or no eyes.
    """
    n = len(surface.vertices)
    label = surface.components()
    named = [part_of(names) for names in surface.names]
    sizes = [np.linalg.norm(move, axis=1) for move in surface.moves.values()]
    total = np.sum(sizes, axis=0) if sizes else np.ones(n)
    moved = np.bincount(label, total)
    if not moved.any():
        raise FaceError("wanted shapes that move the skin, got none that moves a vertex")
    of = np.full(n, -1)  # index into names
    names = [*ORDER, "glass", "eye", "teeth", ""]
    unsure = []
    main = int(np.argmax(moved))
    for k in range(label.max() + 1):
        piece = np.flatnonzero(label == k)
        # A piece with several materials belongs to the part of most of its vertices.
        votes = np.bincount([names.index(named[p]) for p in surface.piece[piece]], minlength=len(names))
        part = names[int(np.argmax(votes))]
        if part in ("", "skin"):
            part = "skin" if k == main else _by_shape(surface, piece, part)
        of[piece] = names.index(part)
    parts = {name: np.flatnonzero(of == names.index(name)) for name in names if name}
    notes = []
    if len(parts["glass"]):
        notes.append("left out what lies over the eyes to be seen through")
    eyes = parts.pop("eye")
    for name, side in (("left_eye", 1), ("right_eye", -1)):
        parts[name] = eyes[surface.vertices[eyes, 0] * side > 0]
    painted = not len(parts["left_eye"]) or not len(parts["right_eye"])
    if painted:
        parts |= _painted(surface, parts)
        notes.append("the eyes are no balls of their own: the eyeLook shapes turn them")
    upper, lower, doubts = _teeth(surface, parts.pop("teeth"))
    parts["upper_teeth"], parts["lower_teeth"] = upper, lower
    unsure += doubts
    parts.pop("glass")
    # Hands and feet are cut off.
    keep: Bool = (surface.vertices[:, 1] > FLOOR) & (np.abs(surface.vertices[:, 0]) < HALF_WIDTH)
    parts = {name: parts[name][keep[parts[name]]].astype(np.int32) for name in ORDER}
    if len(parts["other"]):
        unsure.append(
            f"{len(parts['other'])} vertices are of no known part, they turn with the head: name their "
            "material hair, brows, lashes, teeth, tongue, eye, shirt or skin"
        )
    parts = {name: index for name, index in parts.items() if len(index)}
    notes.insert(0, ", ".join(f"{name} {len(index)}" for name, index in parts.items()) + " vertices")
    return HeadParts(parts, painted, tuple(notes), tuple(unsure))


def _by_shape(surface: Surface, index: Any, named: str) -> str:
    """Return the part of a piece by its shape and movement, if its names do not tell it."""
    at = surface.vertices[index]
    middle = (at.min(axis=0) + at.max(axis=0)) / 2
    if is_ball(at) and abs(middle[1]) < AT_EYE and 0.015 < abs(middle[0]) < 0.055 and middle[2] > -0.05:
        return "eye"
    if named == "skin":
        return "skin"
    moves = [move for name, move in surface.moves.items() if name.startswith("mouth") and move.any()]
    if moves or not surface.moves:
        mouth = surface.centre(moves) if moves else USUAL_MOUTH
        inside = (np.abs(at[:, 0]) < 0.035) & (at[:, 2] < mouth[2] + 0.006)
        if inside.all() and abs(middle[1] - mouth[1]) < 0.035 and middle[2] > mouth[2] - 0.07:
            return "tongue" if _amount(surface, index, "tongueOut") > 0.002 else "teeth"
    moved = max((_amount(surface, index, name) for name in surface.moves), default=0.0)
    return "skin" if moved > 0.004 and len(index) > 200 else "other"


def is_ball(at: Float64) -> bool:
    """Return whether most of the vertices (n, 3) in metres lie on a ball of an eye's size."""
    if len(at) < 12:
        return False
    centre, radius = fit_ball(at)
    deviation = np.abs(np.linalg.norm(at - centre, axis=1) - radius)
    return bool(BALL[0] < radius < BALL[1] and np.percentile(deviation, 80) < ROUND * radius)


def ball_behind(at: Float64) -> tuple[Float64, float]:
    """Return centre and radius of the ball behind an eye (n, 3) that is part of the skin."""
    middle = np.asarray((at.min(axis=0) + at.max(axis=0)) / 2)
    return np.array([middle[0], middle[1], at[:, 2].max() - EYEBALL]), EYEBALL


def _amount(surface: Surface, index: Any, name: str) -> float:
    return float(np.linalg.norm(surface.move(name)[index], axis=1).max(initial=0))


def _painted(surface: Surface, parts: dict[str, Any]) -> dict[str, Any]:
    """Return the eyes in the skin's mesh, which eyeLook shapes move, and the rest of the skin."""
    out: dict[str, Any] = {}
    skin = np.zeros(len(surface.vertices), bool)
    skin[parts["skin"]] = True
    for name, side in (("left_eye", "Left"), ("right_eye", "Right")):
        looks = [np.linalg.norm(surface.move(stem + side), axis=1) for stem in LOOKS]
        amount = np.max(looks, axis=0) * skin
        if amount.max() <= 0:
            raise FaceError(
                f"wanted the {name.replace('_', ' ')}: a ball of its own, a material named eye, or the "
                f"shapes eyeLook...{side}; got none: name the eyes' materials or meshes eye"
            )
        out[name] = np.flatnonzero(amount > 0.3 * amount.max()).astype(np.int32)
    taken = np.concatenate(list(out.values()))
    return out | {"skin": np.setdiff1d(parts["skin"], taken).astype(np.int32)}


def _teeth(surface: Surface, index: Any) -> tuple[Any, Any, list[str]]:
    """Return the upper teeth, the lower teeth, which move with the jaw, and notes about doubts."""
    if not len(index):
        return index, index, []
    drop = np.linalg.norm(surface.move("jawOpen")[index], axis=1)
    labels = surface.subset(index).components()
    if drop.max() > 0.004:
        mean = np.bincount(labels, drop) / np.bincount(labels)
        lower: Bool = mean[labels] > 0.5 * drop.max()
        return index[~lower], index[lower], []
    # In some files the jaw is a bone or fixed: then names decide, or the height.
    names = [" ".join(names).lower() for names in surface.names]
    low = np.array([bool(re.search(r"lower|bottom|_lo", name)) for name in names])[surface.piece[index]]
    if low.any() and not low.all():
        return index[~low], index[low], []
    height = surface.vertices[index, 1]
    tops = np.bincount(labels, height) / np.bincount(labels)
    lower = tops[labels] < (height.min() + height.max()) / 2
    doubt = "jawOpen does not move the teeth: parted by their height, look at them"
    return index[~lower], index[lower], [doubt]
