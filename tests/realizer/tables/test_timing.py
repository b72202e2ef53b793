"""Tests of `realizer.tables.timing`."""

import re

import pytest

from realizer.behaviours.registry import VOCABULARY
from realizer.core.errors import TableError
from realizer.tables.templates import templates
from realizer.tables.timing import Gaps, all_gaps, gaps
from tests.rows import each_row

ROWS = all_gaps()
MEASURED = re.compile(r"Wojdel 2005 table 6\.4, template (\w+) \(?.*?(\d+) frames, sigma (\d+)")


@each_row("name", ROWS)
def test_gaps_have_the_points_of_the_element(name: str) -> None:
    row: Gaps = ROWS[name]
    element = name.partition(".")[0]
    nodes = [cls for tag, cls in VOCABULARY.items() if tag.rpartition("}")[2] == element]
    assert nodes, f"no element {element}"
    assert row.points[0] == "start"
    assert row.points[-1] == "end"
    assert len(row.gaps) == len(row.points) - 1
    assert any(row.points == tuple(cls.sync_points) for cls in nodes)
    for gap in (*row.gaps, *([row.strokes] if row.strokes else ())):
        assert gap.preferred >= gap.least >= 0
        assert gap.stiffness > 0
        assert gap.source


def test_gaps_say_what_to_do_about_an_element_without_a_row() -> None:
    with pytest.raises(
        TableError, match=r"^timing\.toml has no row \[wink\]: add one, or use the timing of another"
    ):
        gaps("wink", "LEFT")


def test_gaps_of_measured_holds_give_the_evident_durations() -> None:
    """An expression is evident from half of its attack to half of its relaxation."""
    found = 0
    for name, row in ROWS.items():
        for gap in row.gaps:
            if (said := MEASURED.search(gap.source)) is None:
                continue
            found += 1
            template = templates()[said[1].upper()]
            assert template.evident == pytest.approx(int(said[2]) / 25), name
            assert template.deviation == pytest.approx(int(said[3]) / 25), name
            attack, hold, relax = row.gaps
            evident = attack.preferred / 2 + hold.preferred + relax.preferred / 2
            assert evident == pytest.approx(template.evident, abs=0.021), name
            assert hold.stiffness == pytest.approx(template.deviation**-2, rel=0.05), name
            least, most = template.possible or (0.0, float("inf"))
            assert least <= evident <= most, name
    assert found >= 6
