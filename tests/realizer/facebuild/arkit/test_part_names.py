"""Tests of what names say of parts."""

from __future__ import annotations

import pytest

from realizer.facebuild.arkit.part_names import part_of


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
