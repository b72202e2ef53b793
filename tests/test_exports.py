"""The public names of each package are those in its `__all__`."""

from __future__ import annotations

import importlib
import pkgutil
from types import ModuleType

import pytest

import bml_schema
import realizer

# Extension points and transports are public by the name of their module, not from the package root.
MODULES = [
    name
    for package in (bml_schema, realizer)
    for _, name, _ in pkgutil.walk_packages(package.__path__, package.__name__ + ".")
    if not name.endswith(("__main__", "_worker", ".worker", ".build_hook"))
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
