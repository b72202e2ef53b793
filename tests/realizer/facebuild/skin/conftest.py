"""The skin of the mask."""

from __future__ import annotations

import pytest

from realizer.facebuild.parts import Part
from realizer.facebuild.person.lids import Lid
from realizer.facebuild.person.lips import Lips
from realizer.facebuild.person.person import Person
from realizer.facebuild.person.recipe import Recipe
from realizer.facebuild.skin.atlas import corners
from realizer.facebuild.skin.skin import Skin
from realizer.facebuild.skin.texels import Texels


@pytest.fixture(scope="session")
def skin(person: Person, mask_lips: Lips, mask_lids: list[Lid], recipe: Recipe, parts: list[Part]) -> Skin:
    """The skin of an old mask with freckles and stubble, on small maps."""
    part = parts[0]
    assert part.patch is not None
    texels = Texels(part.vertices, part.triangles, corners(person.ground.mesh, part.patch), 256)
    old = Recipe("An old mask", {}, recipe.colours, {}, {"age": 0.8, "freckles": 1.0, "stubble": 0.8})
    return Skin(texels, part, person, mask_lips, mask_lids, old, seed=5)
