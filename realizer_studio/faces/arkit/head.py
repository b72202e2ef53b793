"""The head in a glTF file: one surface, cut to a bust and divided into parts."""

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
from realizer_studio.faces.arkit.part_classifier import FLOOR, HALF_WIDTH, ball_behind, sort_parts
from realizer_studio.faces.arkit.scene import read_pieces
from realizer_studio.faces.mpeg4.parameters import ranges

MANY = 100_000  # triangles that a processor draws a few times a second
FEWER = "npx @gltf-transform/cli simplify HEAD.glb LIGHT.glb --ratio 0.2"
EYES, LOOKS, PUPILS = range(23, 29), range(23, 27), range(29, 31)
TONGUE, HEAD = range(43, 48), range(48, 51)
SURE, FAIR, GUESS = "sure", "fair", "guess"


@dataclass(frozen=True)
class FapSource:
    """The source of a FAP's displacement."""

    fap: int
    source: str  # the names of shapes, or a description
    certainty: str  # SURE: shape and feature point are the head's; FAIR: one is guessed; GUESS: both are


@dataclass(frozen=True)
class _Row:
    fap: int
    shapes: str


@cache
def _shapes() -> dict[int, str]:
    return {row.fap: row.shapes for row in csv_rows("fap_sources.csv", _Row, __package__)}


def fap_sources(
    shape_faps: Collection[int], guesses: Collection[str], parts: Collection[str], painted: bool
) -> tuple[FapSource, ...]:
    """Return the sources of the FAPs from 3 to 68.

    Args:
        shape_faps: FAPs that the head's shapes move; guesses: feature points that are guessed.
        parts: parts of the head; painted: whether the eyes are part of the skin's mesh.
    """
    out = []
    for row in faps()[2:]:
        guessed = row.feature_point in guesses
        if row.fap in shape_faps:
            source, certainty = _shapes()[row.fap], FAIR if guessed else SURE
        elif row.fap in LOOKS and painted:
            source, certainty = "eyeLook shapes", SURE
        elif row.fap in EYES and not painted:
            source, certainty = "a turn or push of the eyeball", SURE
        elif row.fap in HEAD:
            source, certainty = "a turn of the head about the neck, by height", FAIR
        elif row.fap in TONGUE and "tongue" not in parts:
            source, certainty = "nothing: there is no tongue", SURE
        else:
            lacks = f" (its shapes {_shapes()[row.fap]} lack or do not fit)" if row.fap in _shapes() else ""
            source, certainty = f"a zone around its point{lacks}", GUESS if guessed else FAIR
        out.append(FapSource(row.fap, source, certainty))
    return tuple(out)


def source_table(sources: Collection[FapSource]) -> tuple[str, ...]:
    """Return the sources as lines of a table, grouped by source."""
    order = sorted(sources, key=lambda one: ((SURE, FAIR, GUESS).index(one.certainty), one.source, one.fap))
    cells = [("FAPs", "move by", "how sure")] + [
        (", ".join(ranges(np.array([one.fap for one in group])).split()), source, certainty)
        for (certainty, source), group in groupby(order, lambda one: (one.certainty, one.source))
    ]
    wide = [max(len(row[k]) for row in cells) for k in range(2)]
    return tuple(f"{a:<{wide[0]}}  {b:<{wide[1]}}  {c}" for a, b, c in cells)


@dataclass(frozen=True)
class Report:
    """The report of an import."""

    found: tuple[str, ...]  # recognised parts and features
    missing: tuple[str, ...]  # missing ones, with the consequences
    unsure: tuple[str, ...]  # guesses to check by eye
    faps: tuple[FapSource, ...] = ()  # the sources of FAPs; empty until they are computed

    @property
    def lines(self) -> tuple[str, ...]:
        kinds = (("found", self.found), ("missing", self.missing), ("unsure", self.unsure))
        lines = tuple(f"{kind}: {word}" for kind, words in kinds for word in words)
        return lines + (source_table(self.faps) if self.faps else ())


@dataclass(frozen=True, eq=False)
class Head:
    """A head that was read from a file."""

    surface: Surface  # upright, in metres, its vertices ordered by part
    ranges: dict[str, tuple[int, int]]  # part -> first, last + 1 vertex
    painted: bool  # whether the eyes are part of the skin's mesh
    gltf: Gltf
    report: Report


def read_head(path: Path) -> Head:
    """Return the head in a file.

    Raises:
        FaceError: the file cannot be read, or has no shapes of a face.
    """
    gltf = Gltf(path)
    pieces = read_pieces(gltf)
    morph_names = list(dict.fromkeys(name for piece in pieces for name in piece.moves))
    if not pieces:
        raise FaceError(f"{path}: wanted a head, found no triangles; export the head's meshes")
    if not morph_names:
        raise FaceError(
            f"{path}: wanted morph targets with ARKit's names (jawOpen, eyeBlinkLeft, ...), found none; "
            "export the head with its shape keys"
        )
    foreign = [name for name in morph_names if canonical(name) is None]
    if len(foreign) == len(morph_names):
        guesses = [
            f"{name} ({' or '.join(nearest(name))}?)" if nearest(name) else name for name in morph_names[:12]
        ]
        raise FaceError(
            f"{path}: wanted morph targets with ARKit's names (jawOpen, eyeBlinkLeft, ...), got "
            f"{', '.join(guesses)}{' ...' if len(morph_names) > 12 else ''}; rename them"
        )
    try:
        surface = merge_pieces(pieces)
        pose = pose_of(surface)
        surface = oriented(surface, pose)
        surface = cut(surface, surface.vertices[:, 1] - FLOOR)
        surface = cut(surface, HALF_WIDTH - np.abs(surface.vertices[:, 0]))
        parts = sort_parts(surface)
    except FaceError as error:
        raise FaceError(f"{path}: {error}") from None
    surface, ranges = parts.arranged(surface)
    fit = ball_behind if parts.painted else fit_ball
    balls = [fit(surface.vertices[slice(*ranges[part])])[0] for part in ("left_eye", "right_eye")]
    surface = replace(surface, vertices=surface.vertices - (balls[0] + balls[1]) / 2)
    found = [f"{len(surface.moves)} of ARKit's {len(shapes())} shapes", *pose.notes, *parts.notes]
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
