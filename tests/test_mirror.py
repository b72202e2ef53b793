"""The tests stand in the same tree as the packages: nothing is without, nothing is left over."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

import bml_schema
import realizer
import realizer_studio
from tests.rows import each_row

TESTS = Path(__file__).parent
PACKAGES = {
    "bml_schema": Path(bml_schema.__path__[0]),
    "realizer": Path(realizer.__path__[0]),
    "realizer_studio": Path(realizer_studio.__path__[0]),
}
# Tested from outside, by documents and a browser: tests/browser, tests/realizer/test_pipeline.py.
ELSEWHERE = {"realizer/examples"}


def packages() -> list[str]:
    found = []
    for name, root in PACKAGES.items():
        inside = sorted(p.parent for p in root.rglob("__init__.py"))
        found += ["/".join([name, *p.relative_to(root).parts]) for p in inside]
    return sorted(set(found) - ELSEWHERE)


@each_row("package", packages())
def test_each_package_has_its_folder_of_tests(package: str) -> None:
    assert list((TESTS / package).glob("test_*.py")), f"write tests/{package}/test_NAME.py"


def test_no_folder_of_tests_is_without_its_package() -> None:
    folders = {p.parent.relative_to(TESTS).as_posix() for p in TESTS.rglob("test_*.py")}
    assert folders - set(packages()) <= {".", "browser", "examples", "realizer/server/web"}


@pytest.mark.parametrize("path", sorted((TESTS / "realizer").glob("test_*.py")), ids=lambda p: p.stem)
def test_tests_beside_the_packages_are_named_after_a_module(path: Path) -> None:
    module = path.stem.removeprefix("test_")
    root = PACKAGES["realizer"]
    assert (root / f"{module}.py").is_file() or (root / module).is_dir()


FEW = 2  # statements in functions; a module with so few has nothing to break: values, types, protocols


def statements(path: Path) -> int:
    """Return the number of statements in a module's functions, apart from docstrings."""
    functions = (ast.FunctionDef, ast.AsyncFunctionDef)
    tree = ast.parse(path.read_text("utf-8"))
    inside = [node for f in ast.walk(tree) if isinstance(f, functions) for node in ast.walk(f)]
    constants = [n for n in inside if isinstance(n, ast.Expr) and isinstance(n.value, ast.Constant)]
    return sum(isinstance(n, ast.stmt) and not isinstance(n, functions) for n in inside) - len(constants)


def test_each_module_has_a_module_of_tests_of_its_name() -> None:
    missing = []
    for name, root in PACKAGES.items():
        for path in sorted(root.rglob("*.py")):
            tests = TESTS / name / path.relative_to(root).with_name(f"test_{path.name}")
            if path.stem not in ("__init__", "__main__") and not tests.is_file() and statements(path) > FEW:
                missing.append(tests.relative_to(TESTS.parent).as_posix())
    assert not missing, f"write {', '.join(missing)}"
