"""Tests of `realizer.core.registry`."""

from __future__ import annotations

import sys

import pytest

from realizer.core import registry
from realizer.core.errors import PluginError
from realizer.core.registry import Registry

GROUP = "realizer.tests"
MODULE = "plugin_of_a_test"


@pytest.fixture
def installed(tmp_path, monkeypatch):
    """A function that installs a package with these entry points of the group."""

    def install(rows: dict[str, str], code: str = "NUMBER = 7") -> None:
        (tmp_path / f"{MODULE}.py").write_text(code)
        folder = tmp_path / "test_plugin-1.0.dist-info"
        folder.mkdir()
        (folder / "METADATA").write_text("Metadata-Version: 2.1\nName: test-plugin\nVersion: 1.0\n")
        lines = [f"[{GROUP}]", *(f"{name} = {value}" for name, value in rows.items())]
        (folder / "entry_points.txt").write_text("\n".join(lines))
        monkeypatch.syspath_prepend(tmp_path)
        registry._installed.cache_clear()

    yield install
    sys.modules.pop(MODULE, None)
    registry._installed.cache_clear()


def numbers() -> Registry[int]:
    ours = {"pi": "math:pi", "tau": "math:tau"}
    return Registry(GROUP, ours, "a number", lambda value: isinstance(value, int))


def test_registry_has_ours_in_their_order(installed):
    installed({})
    assert list(numbers()) == ["pi", "tau"]
    assert len(numbers()) == 2
    assert numbers()["pi"] == pytest.approx(3.14, abs=0.01)


def test_registry_refuses_an_unknown_name(installed):
    installed({})
    assert "e" not in numbers()
    with pytest.raises(KeyError, match="e"):
        numbers()["e"]


def test_registry_imports_a_plugin_when_it_is_used(installed):
    installed({".seven": f"{MODULE}:NUMBER"})
    found = numbers()
    assert list(found) == ["pi", "tau", ".seven"]
    assert ".seven" in found
    assert MODULE not in sys.modules
    assert found[".seven"] == 7
    assert dict(found.working()).keys() == {"pi", "tau", ".seven"}
    assert dict(found.working([".seven"])) == {".seven": 7}


def test_registry_refuses_a_plugin_under_another_name_than_its_own(installed):
    installed({"seven": f"{MODULE}:NUMBER"})
    found = Registry(GROUP, {}, "a number", lambda value: isinstance(value, int), lambda value: f".{value}")
    with pytest.raises(PluginError, match=r"cannot be used: wanted the name '\.7'"):
        found["seven"]


@pytest.mark.parametrize(
    ("value", "code", "says"),
    [
        ("no_such_module:NUMBER", "", "needs the package no_such_module"),
        (f"{MODULE}:NUMBER", "raise OSError('disk')", "cannot be imported: OSError: disk"),
        (f"{MODULE}:NUMBER", "NUMBER = ", "cannot be imported: SyntaxError"),
        (f"{MODULE}:NAME", "NUMBER = 7", "cannot be imported: AttributeError"),
        (f"{MODULE}:NUMBER", "NUMBER = 'seven'", "cannot be used: wanted a number, got 'seven'"),
        (f"{MODULE}:NUMBER", "NUMBER = 'x' * 58", f"cannot be used: wanted a number, got '{'x' * 58}'"),
        (
            f"{MODULE}:NUMBER",
            "NUMBER = 'x' * 59",
            "cannot be used: wanted a number, got an object of the type str",
        ),
        (
            f"{MODULE}:NUMBER",
            "NUMBER = (7, 'x' * 99, 8)",
            "cannot be used: wanted a number, got a tuple of int, str",
        ),
    ],
    ids=[
        "no module",
        "fails",
        "no Python",
        "no attribute",
        "another kind",
        "60 characters",
        "61 characters",
        "a tuple",
    ],
)
def test_registry_leaves_out_a_broken_plugin(installed, caplog, value, code, says):
    installed({"bad": value}, code)
    found = numbers()
    for _ in range(2):
        assert dict(found.working()).keys() == {"pi", "tau"}
    (record,) = caplog.records
    assert record.getMessage().startswith(f"plug-in 'bad' of test-plugin ({GROUP}, {value}) {says}")
    with pytest.raises(PluginError, match="plug-in 'bad'"):
        found["bad"]


def test_registry_keeps_ours_against_a_plugin(installed, caplog):
    installed({"pi": f"{MODULE}:NUMBER"})
    found = numbers()
    assert found["pi"] != 7
    assert list(found) == ["pi", "tau"]
    assert [record.getMessage() for record in caplog.records] == [
        f"plug-in 'pi' of test-plugin ({GROUP}, {MODULE}:NUMBER) is not used: its name is taken"
    ]
