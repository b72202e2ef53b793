"""Tests of the [look] section of a recipe."""

import pytest

from realizer.core.errors import FaceError
from realizer.facebuild.person.appearance import appearance_of


def test_appearance_of_an_empty_table_is_plain() -> None:
    plain, own = appearance_of({}), appearance_of({"stubble": 0.7})
    assert (plain.stubble, own.stubble) == (0.0, 0.7)
    assert own.lips == plain.lips


@pytest.mark.parametrize(
    ("table", "says"),
    [
        ({"beard": 1}, "wanted one of brow_thick"),
        ({"lips": "red"}, "lips: wanted a number"),
        ({"age": True}, "age"),
    ],
)
def test_appearance_of_refuses_what_is_no_figure(table: dict[str, object], says: str) -> None:
    with pytest.raises(FaceError, match=says):
        appearance_of(table)
