"""The script that mutates the library: what it changes, what it leaves alone, and which tests it runs."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from tests.mutations import ROOT, mutations, sample, steps

SKIPPED = '''"""1 + 1"""
from typing import TYPE_CHECKING
import logging

if TYPE_CHECKING:
    from a import b as c  # 1 < 2

log = logging.getLogger(__name__)


def f(x: "1 + 1" = None) -> "0":
    log.info("%d", 1 + 1)
    assert x is not None
    if x:
        raise ValueError(f"{x + 1}")
    try:
        import numba
    except ImportError:
        x = 1
'''


@pytest.mark.parametrize(
    ("source", "wanted"),
    [
        ("a < b", ["a >= b"]),
        ("a not in b", ["a in b"]),
        ("(a) is b", ["(a) is not b"]),
        ("a and b or c", ["a and b and c", "a or b or c"]),
        ("é + b", ["é - b"]),
        ("a + 'b'", []),
        ("a * 2", ["a / 2", "a * 3"]),
        ("x = 2**9, 2**20", ["x = 3**9, 2**20", "x = 2**10, 2**20"]),
        ("not a", ["(a)"]),
        ("if a:\n    pass", ["if not a:\n    pass"]),
        ("a = True", ["a = False"]),
        ("a = 0.0, 0.5", ["a = 1.0, 0.5", "a = 0.0, 1.0"]),
        ("a += b", ["pass"]),
        ("a(b)", ["pass"]),
        ("a.close()", []),
        ("a(maxsize=3, b=3)", ["pass", "a(maxsize=3, b=4)"]),
        ("x = a + 1e-9, 1e-5", ["x = a - 1e-9, 1e-5", "x = a + 1e-9, 2e-05"]),
        ("x = 1e5, 1e6", ["x = 200000.0, 1e6"]),
        ("x = F(ge=0, le=-1e4, b=1e4)", ["x = F(ge=1, le=-1e4, b=1e4)", "x = F(ge=0, le=-1e4, b=20000.0)"]),
        ("return AnError(a or b, 1)", []),
        ("x = zip(a, b[1:], strict=True)", ["x = zip(a, b[2:], strict=True)"]),
        ("x = F(strict=True)", ["x = F(strict=False)"]),
        ("SEED = 3", []),
        ("QUALITY, METHOD = 75, 4", []),
        ("QUALITY, x = 75, 4", ["QUALITY, x = 76, 4", "QUALITY, x = 75, 5"]),
    ],
)
def test_mutations_of_a_line(source: str, wanted: list[str]) -> None:
    data = source.encode()
    assert sorted(m.apply(data).decode() for m in mutations("realizer/x.py", data)) == sorted(wanted)


def test_mutations_leave_out_what_nobody_notices() -> None:
    assert [str(m) for m in mutations("realizer/x.py", SKIPPED.encode())] == ["realizer/x.py:14: x -> not x"]


def test_mutations_leave_out_numbers_that_are_a_matter_of_taste() -> None:
    assert list(mutations("realizer/charts/x.py", b"a = 1.5")) == []


def test_a_sample_is_the_same_for_a_seed_and_every_mutation_is_python() -> None:
    chosen = sample(50, 3, "realizer/core")
    assert chosen == sample(50, 3, "realizer/core") != sample(50, 4, "realizer/core")
    assert len(set(chosen)) == 50
    for mutation in chosen:
        source = (ROOT / mutation.path).read_bytes()
        changed = mutation.apply(source)
        assert changed != source
        ast.parse(changed)


def test_a_sample_draws_the_same_places_if_another_module_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tests.mutations.ROOT", tmp_path)
    (tmp_path / "realizer").mkdir()
    for name in "abc":
        (tmp_path / "realizer" / f"{name}.py").write_text("x = 1, 2, 3, 4, 5\n")
    before = sample(9, 3, "")
    (tmp_path / "realizer" / "a.py").write_text("y = 1, 2 < 3, 4 + 5\n")
    after = sample(9, 3, "")
    assert [m.path for m in before[:3]] == [m.path for m in after[:3]]
    assert {m for m in before if m.path != "realizer/a.py"} == {m for m in after if m.path != "realizer/a.py"}


def test_the_tests_of_a_module_come_nearest_first() -> None:
    first, second, third = steps("realizer/core/units.py")
    assert first == ["tests/realizer/core/test_units.py"]
    assert "tests/realizer/core/test_colours.py" in second
    assert "tests/realizer/test_pipeline.py" in third
