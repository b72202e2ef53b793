"""Tests of `realizer.tables.cooccurrence`."""

from pathlib import Path

import pytest

from realizer.core.errors import TableError
from realizer.tables.cooccurrence import Unit, read_rules, rules

HEAD = "# source: test\n# units: none\n# licence: MIT\n[sets]\nX = [1, 0, 0]\nZ = [0, 0, 1]\n"


def test_rules_are_those_of_appendix_c() -> None:
    found = rules().rules
    by_kind = [sum(rule.kind == kind for rule in found) for kind in ("domination", "opposition")]
    assert by_kind == [15 + 15 + 2, 7]
    assert sum(rule.kind in ("exclusion", "inclusion") for rule in found) == 14
    assert len({rule.text for rule in found}) == len(found)


def test_parse_rule_knows_which_unit_is_weaker() -> None:
    found = {rule.text: rule for rule in rules().rules}
    assert (found["16<12+18"].weaker, found["16<12+18"].stronger) == (16, (Unit(12), Unit(18)))
    assert (found["12<15Z"].weaker, found["12<15Z"].stronger) == (12, (Unit(15, "Z"),))
    assert (found["27@25"].weaker, found["27@25"].stronger) == (25, (Unit(27),))


@pytest.mark.parametrize(
    ("section", "rule", "says"),
    [
        ("domination", "5>63", "wanted two sides with '<' between them, as 16<12+18"),
        ("domination", "5<", "wanted the number of an action unit, got ''"),
        ("domination", "5<99", "wanted an action unit that a face shows, got AU99"),
        ("domination", "12<15Q", "wanted X or Z after the number, got '15Q'"),
        ("domination", "12<12Z", "AU12 stands on both sides"),
        ("domination", "5<6+7+9", "wanted one unit or 2 together on the right, got 3"),
        ("exclusion", "12@15Z", "wanted no letter here after the number, got '15Z'"),
        ("opposition", "51<52", "wanted two sides with '@' between them, as 27@25"),
    ],
)
def test_read_rules_refuses_an_invalid_rule(section: str, rule: str, says: str) -> None:
    with pytest.raises(TableError) as caught:
        read_rules(f'{HEAD}[{section}]\nrules = ["{rule}"]\n', "mine.toml")
    line = HEAD.count("\n") + 2
    assert str(caught.value) == f"mine.toml:{line}, [{section}] {rule!r}: {says}"


def test_read_rules_names_the_line_of_a_repeated_rule() -> None:
    with pytest.raises(TableError) as caught:
        read_rules(
            f'{HEAD}[domination]\nrules = [\n  "5<63",\n  "7<6",  # "5<63"\n  "5<63",\n]\n', "mine.toml"
        )
    assert str(caught.value).startswith(
        f"mine.toml:{HEAD.count(chr(10)) + 5}, [domination] '5<63': says the same"
    )


def test_read_rules_refuses_a_cycle() -> None:
    with pytest.raises(TableError) as caught:
        read_rules(f'{HEAD}[domination]\nrules = ["5<63", "1<2", "2<4", "4<1"]\n', "mine.toml")
    line = HEAD.count("\n") + 2
    assert str(caught.value) == f"mine.toml:{line}, [domination] '4<1': closes a cycle with 1<2, 2<4"


def test_read_rules_reports_all_faults_at_once() -> None:
    with pytest.raises(TableError) as caught:
        read_rules(
            f'{HEAD}Y = [0, 2]\n[dominance]\n[domination]\nrules = ["5<63", "63<5", "5<63"]\n', "mine.toml"
        )
    lines = str(caught.value).splitlines()
    assert len(lines) == 4
    assert "[dominance]" in lines[0]
    assert "[sets] Y: wanted three memberships" in lines[1]
    assert "'63<5': says the opposite of '5<63'" in lines[2]
    assert "'5<63': says the same as '5<63'" in lines[3]


def test_rules_name_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(TableError, match=r"none\.toml: wanted a file of co-occurrence rules"):
        rules(tmp_path / "none.toml")


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("sets = 3\n", "wanted a section [sets], got sets = 3"),
        ("domination = 3\n", "wanted a section [domination], got domination = 3"),
        ('[domination]\nrules = "5<63"\n', "[domination]: wanted rules = [\"...\"], got '5<63'"),
        ('[domination]\nrule = ["5<63"]\n', "[domination]: wanted rules = [...] alone, got rule"),
        ('[exclusion]\nrules = ["1@2"]\n', "[sets]: wanted X = [1, 0, 0], or how else a unit is small"),
    ],
)
def test_read_rules_refuses_other_sections(text: str, says: str) -> None:
    with pytest.raises(TableError) as caught:
        read_rules(f"# source: test\n# units: none\n# licence: MIT\n{text}", "mine.toml")
    (line,) = str(caught.value).splitlines()
    assert says in line
