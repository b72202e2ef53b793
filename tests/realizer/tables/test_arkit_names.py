"""Tests of `realizer.tables.arkit_names`."""

import re
from collections.abc import Callable

import pytest

from realizer.tables.arkit_names import canonical, nearest, shapes


def test_shapes_are_the_52_of_arkit() -> None:
    assert len(shapes()) == 52
    assert (shapes()["mouthSmileLeft"].au, shapes()["mouthSmileLeft"].side) == (12, "L")


@pytest.mark.parametrize(
    "spell",
    [lambda n: n.replace("Left", "_L").replace("Right", "_R"), lambda n: n[0].upper() + n[1:],
     lambda n: f"blendShape1.{n}", lambda n: f"Head_{n}",
     lambda n: re.sub("(.+)(Left|Right)", r"\2_\1", n)],
)  # fmt: skip
def test_canonical_understands_usual_spellings(spell: Callable[[str], str]) -> None:
    assert {canonical(spell(name)) for name in shapes()} == set(shapes())


def test_canonical_understands_a_side_after_a_dot() -> None:
    assert canonical("head_eyeBlink.R") == "eyeBlinkRight"


@pytest.mark.parametrize("name", ["viseme_aa", "", "jaw", "open", "L"])
def test_canonical_returns_none_for_other_names(name: str) -> None:
    assert canonical(name) is None


def test_nearest_suggests_names_for_a_misspelt_one() -> None:
    assert nearest("mouthSmileLeftt")[0] == "mouthSmileLeft"
    assert nearest("hat") == ()
