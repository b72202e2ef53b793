"""Tests of hair."""

from dataclasses import fields, replace

import numpy as np
import pytest
import scipy.sparse as sp

from realizer.core.errors import FaceError
from realizer.face.load import load_face
from realizer.face.mesh_geometry import vertex_normals
from realizer.facebuild.person.hair import Style, hair, shadow, style_of
from realizer.facebuild.person.scalp import Scalp
from realizer.facebuild.submesh import Submesh
from realizer.tables import read_toml, text_of

pytestmark = pytest.mark.xdist_group("faces")

STYLES = list(read_toml(text_of("hair.toml"), "hair.toml")["styles"])
LOOK = {"hair": [70, 48, 36], "skin": [226, 178, 152]}
CLOSE = ("bun", "short", "buzz", "receding", "rim")  # styles that hang nowhere


@pytest.fixture(scope="module")
def head() -> tuple[Submesh, np.ndarray, dict[str, np.ndarray]]:
    face = load_face()
    first, last = face.parts["skin"]
    base = face.vertices[first:last].astype(float)
    mine = face.triangles[((face.triangles >= first) & (face.triangles < last)).all(axis=1)] - first
    patch = Submesh(sp.eye_array(len(base), format="csr"), np.zeros_like(base), mine)
    return patch, base, {name: np.array(at, float) for name, at in face.points.items()}


def scalp(head: tuple, style: Style) -> Scalp:
    return Scalp(*head, style.line, style.rise)


@pytest.mark.parametrize("name", STYLES)
def test_hair_of_every_style_is_a_sound_mesh(head: tuple, name: str) -> None:
    style = style_of({"style": name})
    for part in hair(scalp(head, style), style, LOOK):
        assert part.name == "hair"
        assert len(part.vertices) < 1400
        assert np.isfinite(part.vertices).all()
        assert np.allclose(
            np.linalg.norm(vertex_normals(part.vertices, part.triangles), axis=1), 1, atol=1e-6
        )
        assert part.colours.min() >= 0
        assert part.colours.max() <= 255


@pytest.mark.parametrize("name", STYLES)
def test_hair_leaves_brows_eyes_and_mouth_free(head: tuple, name: str) -> None:
    style = style_of({"style": name})
    at = np.concatenate([part.vertices for part in hair(scalp(head, style), style, LOOK)])
    before = at[(at[:, 2] > 0) & (at[:, 1] < head[2]["11.1"][1] - 0.02)]
    assert not len(before) or np.abs(before[:, 0]).min() > 0.045


@pytest.mark.parametrize("name", CLOSE)
def test_hair_lies_on_the_skull_and_hides_it(head: tuple, name: str) -> None:
    style = style_of({"style": name})
    mine = scalp(head, style)
    part = hair(mine, style, LOOK)[0]
    lift, _ = mine.lift(part.vertices)
    assert lift.min() > -0.002
    # The hairline itself lies in the skin, all else above it.
    assert np.mean(lift > 0) > 0.8
    assert vertex_normals(part.vertices, part.triangles)[np.argmax(part.vertices[:, 1]), 1] > 0.3


def test_hair_hangs_as_far_down_as_its_style_says(head: tuple) -> None:
    low = {}
    for name in ("short", "bob", "long"):
        style = style_of({"style": name})
        low[name] = min(part.vertices[:, 1].min() for part in hair(scalp(head, style), style, LOOK))
    assert low["short"] > low["bob"] + 0.02 > low["long"] + 0.05


def test_style_of_changes_single_figures(head: tuple) -> None:
    style = style_of({"style": "short", "grey": 0.9, "sides": 0.2})
    assert (style.grey, style.sides) == (0.9, 0.2)
    plain = style_of({"style": "short"})
    assert replace(style, grey=plain.grey, sides=plain.sides) == plain
    mine = scalp(head, style)
    grey, brown = (hair(mine, one, LOOK)[0].colours.mean(axis=0) for one in (style, plain))
    assert np.ptp(grey) < 0.7 * np.ptp(brown)


@pytest.mark.parametrize(
    ("table", "says"), [({"style": "mohican"}, "wanted one of bun"), ({"styl": "bun"}, "got 'styl'")]
)
def test_style_of_refuses_unknown_styles_and_figures(table: dict[str, str], says: str) -> None:
    with pytest.raises(FaceError, match=says):
        style_of(table)


def test_shadow_lies_under_hair_alone(head: tuple) -> None:
    style = style_of({"style": "short"})
    mine = scalp(head, style)
    places = np.array([head[2][name] for name in ("11.4", "9.3", "4.1", "2.1")])
    dark = shadow(mine, style, places)
    assert dark[0] > 0.5
    assert (dark[1:] == 0).all()
    assert (shadow(mine, style_of({"style": "rim"}), places[:1]) == 0).all()


def test_style_has_every_figure_of_the_table() -> None:
    table = read_toml(text_of("hair.toml"), "hair.toml")
    assert {field.name for field in fields(Style)} == {*table["plain"], "line"}
