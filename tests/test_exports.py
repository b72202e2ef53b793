"""The public names of each package are those in its `__all__`."""

from __future__ import annotations

import importlib
import pkgutil
from types import ModuleType

import pytest

import bml_schema
import realizer
import realizer_studio

# Extension points and transports are public by the name of their module, not from the package root.
MODULES = [
    name
    for package in (bml_schema, realizer, realizer_studio)
    for _, name, _ in pkgutil.walk_packages(package.__path__, package.__name__ + ".")
    if not name.endswith(("__main__", "_worker", ".worker"))
]


def test_each_module_defines_what_it_exports() -> None:
    for name in MODULES:
        module = importlib.import_module(name)
        missing = [public for public in getattr(module, "__all__", ()) if not hasattr(module, public)]
        assert not missing


def test_bml_schema_exports_what_it_imports() -> None:
    names = {name for name, value in vars(bml_schema).items() if not isinstance(value, ModuleType)}
    assert {name for name in names if not name.startswith("_")} == set(bml_schema.__all__)


def test_every_name_the_root_promises_is_there() -> None:
    for name in realizer.__all__:
        assert getattr(realizer, name) is not None
    assert set(realizer.__all__) <= set(dir(realizer))


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="no attribute 'sing'"):
        _ = realizer.sing  # type: ignore[attr-defined]


def test_public_functions_work_when_every_module_is_imported() -> None:
    """A module of the same name would hide a function: `realizer.check` is no module."""
    for name in MODULES:
        importlib.import_module(name)
    bml = '<bml id="b"><head id="n" lexeme="NOD" stroke="1"/></bml>'
    played = realizer.realize(bml, idle=False)
    assert played.schedules[0].at("n", "stroke") == realizer.schedule(bml).at("n", "stroke") == 1
    assert isinstance(played, realizer.Realization)
    assert realizer.check(bml) == []
    assert "<speech" in realizer.enrich("Hello there")
    assert realizer.emotion("joy").frame().any()
    assert "silent" in [voice.name for voice in realizer.voices()]
    assert realizer.load_face("ada").name in [face.name for face in realizer.faces()]
    assert realizer.Player().blocks is not None
    assert callable(realizer.client.connect)
    assert callable(realizer.serve)
    functions = {name for name in realizer.__all__ if callable(getattr(realizer, name))}
    assert not functions & {
        name.rpartition(".")[2] for name in MODULES if name.count(".") == 1 and name.startswith("realizer.")
    }
