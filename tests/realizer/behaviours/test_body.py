"""Tests of the behaviours of the body."""

from __future__ import annotations

import pytest

from tests.realizer.behaviours.elements import ELEMENTS, expand


@pytest.mark.parametrize("element", [e for e in ELEMENTS if e.startswith(("<ge", "<po", "<lo", "<wa"))])
def test_body_behaviours_move_no_face(element: str) -> None:
    assert expand(element) == ()
