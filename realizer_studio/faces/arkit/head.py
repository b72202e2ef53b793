"""The head in a glTF file: one surface, cut to a bust, sorted into parts."""

from collections.abc import Collection
from dataclasses import dataclass, replace
from functools import cache
from itertools import groupby
from pathlib import Path

import numpy as np

from realizer.core.errors import FaceError
from realizer.face.mesh_geometry import fit_ball
from realizer.tables import csv_rows, faps
from realizer.tables.arkit_names import canonical, nearest, shapes
from realizer_studio.faces.arkit.gltf import Gltf
from realizer_studio.faces.arkit.mesh_merge import Surface, cut, merge_pieces
from realizer_studio.faces.arkit.orientation import oriented, pose_of
from realizer_studio.faces.arkit.part_classifier import ASIDE, FLOOR, ball_behind, sort_parts
from realizer_studio.faces.arkit.scene import read_pieces
from realizer_studio.faces.mpeg4.parameters import ranges

MANY = 100_000  # triangles that a processor draws a few times a second
FEWER = "npx @gltf-transform/cli simplify HEAD.glb LIGHT.glb --ratio 0.2"
EYES, LOOKS, PUPILS = range(23, 29), range(23, 27), range(29, 31)
TONGUE, HEAD = range(43, 48), range(48, 51)
SURE, FAIR, GUESS = "sure", "fair", "guess"


@dataclass(frozen=True)
class FapSource:
    """What moves a FAP."""

    fap: int
    made_by: str  # the names of shapes, or in words what else
    sure: str  # SURE: by the head itself; FAIR: one of shape and feature point is not its own; GUESS: both


@dataclass(frozen=True)
class _Row:
    fap: int
    shapes: str


@cache
def _shapes() -> dict[int, str]:
    return {row.fap: row.shapes for row in csv_rows("fap_sources.csv", _Row, __package__)}


def fap_sources(
    made: Collection[int], guesses: Collection[str], parts: Collection[str], painted: bool
) -> tuple[FapSource, ...]:
    """Return what moves each FAP from 3 to 68.

    Args:
        made: FAPs that the head's shapes move; guesses: feature points that its shapes do not show.
        parts: parts of the head; painted: whether the eyes are no balls of their own.
    """
    out = []
    for row in faps()[2:]:
        guessed = row.feature_point in guesses
        if row.fap in made:
            words, sure = _shapes()[row.fap], FAIR if guessed else SURE
        elif row.fap in LOOKS and painted:
            words, sure = "eyeLook shapes", SURE
        elif row.fap in EYES and not painted:
            words, sure = "a turn or push of the eyeball", SURE
        elif row.fap in HEAD:
            words, sure = "a turn of the head about the neck, by height", FAIR
        elif row.fap in TONGUE and "tongue" not in parts:
            words, sure = "nothing: there is no tongue", SURE
        else:
            lacks = f" (its shapes {_shapes()[row.fap]} lack or do not fit)" if row.fap in _shapes() else ""
            words, sure = f"a zone around its point{lacks}", GUESS if guessed else FAIR
        out.append(FapSource(row.fap, words, sure))
    return tuple(out)


def source_table(sources: Collection[FapSource]) -> tuple[str, ...]:
    """Return the sources as lines of a table, FAPs of the same source together."""
    order = sorted(sources, key=lambda one: ((SURE, FAIR, GUESS).index(one.sure), one.made_by, one.fap))
    cells = [("FAPs", "move by", "how sure")] + [
        (", ".join(ranges(np.array([one.fap for one in group])).split()), made_by, sure)
        for (sure, made_by), group in groupby(order, lambda one: (one.sure, one.made_by))
    ]
    wide = [max(len(row[k]) for row in cells) for k in range(2)]
    return tuple(f"{a:<{wide[0]}}  {b:<{wide[1]}}  {c}" for a, b, c in cells)


@dataclass(frozen=True)
class Report:
    """The report of an import."""

    found: tuple[str, ...]  # parts and features that were recognised
    missing: tuple[str, ...]  # those that were not, with the consequences
    unsure: tuple[str, ...]  # guesses to check by eye
    faps: tuple[FapSource, ...] = ()  # what moves each FAP; empty before that is known

    @property
    def lines(self) -> tuple[str, ...]:
        kinds = (("found", self.found), ("missing", self.missing), ("unsure", self.unsure))
        lines = tuple(f"{kind}: {word}" for kind, words in kinds for word in words)
        return lines + (source_table(self.faps) if self.faps else ())


@dataclass(frozen=True, eq=False)
class Head:
    """A head on the way from a file to a face folder."""

    surface: Surface  # upright, in metres, its vertices part after part
    ranges: dict[str, tuple[int, int]]  # part -> first, last + 1 vertex
    painted: bool  # whether the eyes are no balls of their own
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
    surface, ranges = parts.arranged(surface)
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
