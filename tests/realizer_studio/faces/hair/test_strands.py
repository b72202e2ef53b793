"""Tests of strands."""

import numpy as np
import pytest

from realizer_studio.faces.hair.strands import Flow, Strands, edge, grow, roots, shadow, thickness, unit
from realizer_studio.faces.hair.style import Style, style_of
from realizer_studio.faces.person.scalp import Scalp


def grown(scalp: Scalp, style: Style) -> Strands:
    rng = np.random.default_rng(1)
    at = roots(scalp, style, 40, 0.003, 1.0, rng)
    return grow(scalp, style, at, np.linspace(0, 1, 40), np.full(40, max(style.length)), 8, rng)


def test_unit_makes_vectors_of_length_one() -> None:
    assert unit(np.array([[3.0, 0, 4.0]])) == pytest.approx(np.array([[0.6, 0, 0.8]]))


def test_roots_are_spread_evenly_inside_the_hairline(scalp: Scalp, style: Style) -> None:
    from scipy.spatial import cKDTree

    at = roots(scalp, style, 60, 0.003, 1.0, np.random.default_rng(1))
    assert edge(scalp, style, at).min() > 0.003
    apart = cKDTree(at).query(at, 2)[0][:, 1]
    assert apart.min() > 0.4 * apart.mean()


def test_flow_leads_away_from_the_parting_or_back_to_it(scalp: Scalp) -> None:
    at = scalp.middle + np.array([[0.06, 0.06, 0.0], [-0.06, 0.06, 0.02]])
    free, tied = (Flow(scalp, style_of({"style": name, "stray": 0.0}))(at) for name in ("long", "bun"))
    assert free[0, 0] > 0 > free[1, 0]
    assert (tied[:, 2] < 0).all()


def test_grow_keeps_short_hair_on_the_skull(scalp: Scalp, style: Style) -> None:
    strands = grown(scalp, style)
    at = strands.positions[strands.length > 0].reshape(-1, 3)
    lift = scalp.lift(at)[0]
    assert lift.min() > -0.004
    assert (lift < 1.3 * thickness(scalp, style, at) + 0.003).mean() > 0.95


@pytest.mark.parametrize("name", ["bob", "long"])
def test_grow_hangs_hair_beside_the_face(scalp: Scalp, name: str) -> None:
    style = style_of({"style": name})
    strands = grown(scalp, style)
    at = strands.positions[strands.length > 0].reshape(-1, 3)
    assert at[:, 1].min() < -0.06
    before = at[(at[:, 2] > 0.02) & (at[:, 1] < 0.03)]
    assert not len(before) or np.abs(before[:, 0]).min() > 0.045


def test_grow_ends_bobs_above_long_hair(scalp: Scalp) -> None:
    low = {name: grown(scalp, style_of({"style": name})).positions[..., 1].min() for name in ("bob", "long")}
    assert low["bob"] > low["long"] + 0.05


def test_shadow_lies_under_hair_alone(scalp: Scalp, style: Style, points: dict[str, np.ndarray]) -> None:
    places = np.array([points[name] for name in ("11.4", "9.3", "4.1", "2.1")])
    dark = shadow(scalp, style, places)
    assert dark[0] > 0.5
    assert (dark[1:] == 0).all()
    assert (shadow(scalp, style_of({"style": "rim"}), places[:1]) == 0).all()
