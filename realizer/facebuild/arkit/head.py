"""The head in a glTF file: one surface, cut to a bust, sorted into parts."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from realizer.core.errors import FaceError
from realizer.face.mesh_geometry import fit_ball
from realizer.facebuild.arkit.fap_sources import FapSource, source_table
from realizer.facebuild.arkit.gltf import Gltf
from realizer.facebuild.arkit.mesh_merge import Surface, cut, merge_pieces
from realizer.facebuild.arkit.orientation import oriented, pose_of
from realizer.facebuild.arkit.part_classifier import ASIDE, FLOOR, ball_behind, sort_parts
from realizer.facebuild.arkit.scene import read_pieces
from realizer.tables.arkit_names import canonical, nearest, shapes

MANY = 100_000  # triangles that a processor draws a few times a second
FEWER = "npx @gltf-transform/cli simplify HEAD.glb LIGHT.glb --ratio 0.2"


@dataclass(frozen=True)
class Report:
    """The report of an import.

    Attributes:
        found: parts and features that were recognised; missing: those that were not, with the consequences.
        unsure: guesses to check by eye.
        faps: what moves each FAP; empty before that is known.
    """

    found: tuple[str, ...]
    missing: tuple[str, ...]
    unsure: tuple[str, ...]
    faps: tuple[FapSource, ...] = ()

    @property
    def lines(self) -> tuple[str, ...]:
        kinds = (("found", self.found), ("missing", self.missing), ("unsure", self.unsure))
        lines = tuple(f"{kind}: {word}" for kind, words in kinds for word in words)
        return lines + (source_table(self.faps) if self.faps else ())


@dataclass(frozen=True, eq=False)
class Head:
    """A head on the way from a file to a face folder.

    Attributes:
        surface: upright, in metres, its vertices part after part; ranges: part -> first, last + 1 vertex.
        painted: whether the eyes are no balls of their own.
    """

    surface: Surface
    ranges: dict[str, tuple[int, int]]
    painted: bool
    gltf: Gltf
    report: Report


def read_head(path: Path) -> Head:
    """Return the head in a file.

    Raises:
        FaceError: the file cannot be read, or has no shapes of a face.
    """
    gltf = Gltf(path)
    pieces = read_pieces(gltf)
    own = list(dict.fromkeys(name for piece in pieces for name in piece.moves))
    if not pieces:
        raise FaceError(f"{path}: wanted a head, found no triangles; export the head's meshes")
    if not own:
        raise FaceError(
            f"{path}: wanted morph targets with ARKit's names (jawOpen, eyeBlinkLeft, ...), found none; "
            "export the head with its shape keys"
        )
    foreign = [name for name in own if canonical(name) is None]
    if len(foreign) == len(own):
        guesses = [f"{name} ({' or '.join(nearest(name))}?)" if nearest(name) else name for name in own[:12]]
        raise FaceError(
            f"{path}: wanted morph targets with ARKit's names (jawOpen, eyeBlinkLeft, ...), got "
            f"{', '.join(guesses)}{' ...' if len(own) > 12 else ''}; rename them"
        )
    try:
        surface = merge_pieces(pieces)
        pose = pose_of(surface)
        surface = oriented(surface, pose)
        surface = cut(surface, surface.vertices[:, 1] - FLOOR)
        surface = cut(surface, ASIDE - np.abs(surface.vertices[:, 0]))
        parts = sort_parts(surface)
    except FaceError as error:
        raise FaceError(f"{path}: {error}") from None
    surface = surface.subset(np.concatenate(list(parts.parts.values())))
    ends = np.cumsum([0] + [len(index) for index in parts.parts.values()])
    ranges = {name: (int(ends[k]), int(ends[k + 1])) for k, name in enumerate(parts.parts)}
    fit = ball_behind if parts.painted else fit_ball
    balls = [fit(surface.vertices[slice(*ranges[part])])[0] for part in ("left_eye", "right_eye")]
    surface = replace(surface, vertices=surface.vertices - (balls[0] + balls[1]) / 2)
    found = [f"{len(surface.moves)} of ARKit's {len(shapes())} shapes", *pose.notes, *parts.words]
    notes: dict[str, dict[str, None]] = {}  # -> materials
    for piece in pieces:
        for note in piece.notes:
            notes.setdefault(note, {})[piece.material.name or "without a name"] = None
    if foreign:
        found.append(f"shapes of other names are left out: {', '.join(foreign)}")
    missing = [f"{note} (materials: {', '.join(names)})" for note, names in notes.items()] + [
        f"{row.name}: {row.without}"
        for row in shapes().values()
        if row.name not in surface.moves
        and row.without != "nothing"
        and (parts.painted or "eyeLook" not in row.name)
    ]
    missing += [
        f"{part.replace('_', ' ')}: {without}"
        for part, without in (
            ("tongue", "FAPs 43 to 47 move nothing"),
            ("lower_teeth", "nothing stands behind the open lips"),
        )
        if part not in ranges
    ]
    unsure = (*pose.unsure, *parts.unsure)
    if len(surface.triangles) > MANY:
        unsure = (*unsure, f"{len(surface.triangles):,} triangles are drawn slowly; for fewer: {FEWER}")
    return Head(
        surface, ranges, parts.painted, gltf,
        Report(tuple(found), tuple(missing), unsure),
    )  # fmt: skip
