"""`surfaces`: the table of how kinds of surfaces reflect light."""

import numpy as np

from realizer.face.drawn_mesh import CLOTH, EYE, HAIR, SKIN, WET
from realizer.render.surfaces import COAT, REFLECTION, SHADED, SHARP_SHARE, SOFT, THROUGH, WRAP, surfaces


def test_surfaces_have_a_row_for_each_kind():
    assert surfaces().shape == (max(SKIN, EYE, HAIR, WET, CLOTH) + 1, COAT + 1)


def test_surfaces_keep_shares_between_0_and_1():
    rows = surfaces()
    assert ((rows >= 0) & (rows <= 1)).all()
    assert (rows[:, [REFLECTION]] < 0.06).all()
    assert (rows[:, SHARP_SHARE] < 1).all()


def test_surfaces_let_red_reach_furthest_in_skin():
    skin = surfaces()[SKIN]
    assert (np.diff(skin[WRAP:SHADED]) < 0).all()
    assert (np.diff(skin[SOFT:REFLECTION]) < 0).all()
    assert surfaces()[:, THROUGH].argmax() == SKIN
