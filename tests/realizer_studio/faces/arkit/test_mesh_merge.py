"""Tests of the merging of pieces into one mesh."""

from __future__ import annotations

import numpy as np
import pytest

from realizer.core.errors import FaceError
from realizer_studio.faces.arkit.materials import Material
from realizer_studio.faces.arkit.mesh_merge import Surface, cut, merge_pieces, part_of
from realizer_studio.faces.arkit.scene import Piece

SQUARE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0.0]])
PLAIN = Material("", (0.5, 1, 1, 1), (0, 0, 0), None, "OPAQUE", 0.5, 0, ())
HALVES = np.array([[0, 1, 2], [0, 2, 3]], np.int32)


def piece(aside: float = 0, glass: bool = False, name: str = "skin", **moves: float) -> Piece:
    """A square whose vertices all move up by what a shape's name says."""
    up = {name: np.tile([0, amount, 0.0], (4, 1)) for name, amount in moves.items()}
    return Piece(
        (name, "m", "n"), SQUARE + np.array([aside, 0, 0]), HALVES, np.full((4, 3), 9.0), SQUARE[:, :2],
        PLAIN, glass, (), up,
    )  # fmt: skip


def test_merge_pieces_shares_the_vertices_of_a_seam() -> None:
    surface = merge_pieces([piece(), piece(1)])
    assert len(surface.vertices) == 6
    assert len(surface.triangles) == 4
    assert set(surface.piece.tolist()) == {0, 1}


def test_merge_pieces_keeps_hair_that_is_rooted_in_skin_apart() -> None:
    surface = merge_pieces([piece(), piece(1, name="hair_cards"), piece(2, name="Material.001")])
    assert len(surface.vertices) == 12
    assert surface.components().max() == 2


def test_merge_pieces_keeps_a_seam_that_opens() -> None:
    surface = merge_pieces([piece(jawOpen=0.0), piece(1, jawOpen=-0.5)])
    assert len(surface.vertices) == 8
    assert sorted(surface.move("jawOpen")[:, 1].tolist()) == [-0.5] * 4 + [0] * 4
    assert not surface.move("eyeBlinkLeft").any()


def test_merge_pieces_uses_arkit_names_and_drops_glass() -> None:
    surface = merge_pieces([piece(Mouth_Smile_L=1.0, hat=1.0), piece(5, glass=True)])
    assert list(surface.moves) == ["mouthSmileLeft"]
    assert len(surface.vertices) == 4


def test_merge_pieces_refuses_glass_alone() -> None:
    with pytest.raises(FaceError, match="got transparent ones alone"):
        merge_pieces([piece(glass=True)])


@pytest.mark.parametrize("amount", [np.nan, np.inf, -np.inf, 1e300, -2e6])
def test_merge_pieces_refuses_moves_far_larger_than_the_head(amount: float) -> None:
    with pytest.raises(FaceError, match="wanted finite places and moves"):
        merge_pieces([piece(jawOpen=amount)])


@pytest.mark.parametrize("aside", [np.nan, np.inf, 1e300])
def test_merge_pieces_refuses_places_that_are_not_of_a_head(aside: float) -> None:
    with pytest.raises(FaceError, match="wanted finite places and moves"):
        merge_pieces([piece(aside, jawOpen=0.1)])


def test_surface_subset_keeps_triangles_between_its_vertices() -> None:
    whole = merge_pieces([piece(jawOpen=1.0)])
    surface = whole.subset(whole.triangles[0][::-1])
    assert surface.triangles.tolist() == [[2, 1, 0]]
    assert len(surface.move("jawOpen")) == len(surface.colours) == 3


def test_cut_ends_the_surface_along_a_straight_line() -> None:
    surface = merge_pieces([piece(jawOpen=1.0)])
    left = cut(surface, surface.vertices[:, 0] - 0.25)
    assert left.vertices[:, 0].min() == pytest.approx(0.25)
    assert area(left) == pytest.approx(0.75)
    assert (left.move("jawOpen")[:, 1] == 1).all()
    assert cut(surface, np.ones(4)) is surface


def test_cut_keeps_the_places_in_textures() -> None:
    left = cut(surface := merge_pieces([piece(jawOpen=1.0)]), surface.vertices[:, 0] - 0.25)
    assert left.uv == pytest.approx(left.vertices[left.triangles][..., :2])
    assert len(left.material) == len(left.triangles)


def test_painted_colours_are_those_of_vertices_and_materials() -> None:
    colours = merge_pieces([piece()]).painted_colours()
    assert colours[:, 1:] == pytest.approx(np.full((4, 2), 9))
    assert 4 < colours[0, 0] < 6  # half the light


def area(surface: Surface) -> float:
    a, b, c = (surface.vertices[surface.triangles[:, k]] for k in range(3))
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


@pytest.mark.parametrize(
    ("names", "part"),
    [
        (("Teeth_Lower", "", ""), "teeth"),
        (("", "Hair", ""), "hair"),
        (("Skin", "Tongue", ""), "tongue"),
        (("Skin", "", "Head"), "skin"),
        (("", "Object_1", ""), ""),
        (("Glasses", "", ""), "other"),
        (("Glasses_Lens", "", ""), "glass"),
    ],
)
def test_part_of_reads_material_mesh_and_node(names: tuple[str, str, str], part: str) -> None:
    assert part_of(names) == part
