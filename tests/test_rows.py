"""Tests of the tests of tables."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.rows import each_row

ROWS = [(1, 1), (2, 3), (4, 4), (5, 6)]


def test_each_row_runs_all_rows_and_names_those_that_fail(tmp_path: Path) -> None:
    seen: list[int] = []

    @each_row("one, other", ROWS)
    def same(one: int, other: int) -> None:
        seen.append(one)
        assert one == other, f"{one} is not {other}"

    with pytest.raises(ExceptionGroup, match="2 of 4 rows") as caught:
        same()
    assert seen == [1, 2, 4, 5]
    assert [str(error).splitlines()[0] for error in caught.value.exceptions] == ["2 is not 3", "5 is not 6"]
    assert [error.__notes__ for error in caught.value.exceptions] == [
        ["in the row (2, 3)"],
        ["in the row (5, 6)"],
    ]


@pytest.mark.parametrize("folder", ["a", "b"])
@each_row("number", range(3))
def test_each_row_leaves_parameters_and_fixtures_to_pytest(folder: str, number: int, tmp_path: Path) -> None:
    (tmp_path / folder).mkdir(exist_ok=number > 0)
    assert len(list(tmp_path.iterdir())) == 1
