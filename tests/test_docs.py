"""The Markdown files: links resolve, and the files, modules and tests that they name exist."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path

import pytest

import realizer

ROOT = Path(__file__).parent.parent
FILES = ("*.md", "*.txt", "examples/*.md", "docs/**/*.md", "faces/*.md", "docker/*.md", "bml_schema/xsd/*.md")
PAGES = [page for pattern in FILES for page in sorted(ROOT.glob(pattern))]
LINK = re.compile(r"\]\(([^)\s]+)\)")
CODE = re.compile(r"```.*?```|`[^`\n]+`", re.DOTALL)
# A path with a folder and a suffix of ours, or a folder of the packages; not a part of a longer path.
PATH = re.compile(
    r"(?<![\w./:$-])((?:[\w-]+/)+[\w.-]+\.(?:py|csv|toml|js|xsd|sh)\b|(?:realizer|bml_schema|tests)/(?:[\w-]+/)*)"
)
MODULE = re.compile(r"python -m ((?:tests|realizer)[\w.]*)")
TEST = re.compile(r"\btest_\w+")


def relative(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def code(page: Path) -> str:
    return "\n".join(CODE.findall(page.read_text("utf-8")))


@cache
def known_tests() -> str:
    """All names of test functions and test modules."""
    files = [*(ROOT / "tests").rglob("test_*.py")]
    functions = [m for f in files for m in re.findall(r"def (test_\w+)", f.read_text("utf-8"))]
    return "\n".join([f.stem for f in files] + functions)


def test_readme_is_short() -> None:
    if not (ROOT / "README.md").is_file():
        pytest.skip("no README.md beside the tests")
    assert len((ROOT / "README.md").read_text("utf-8").splitlines()) <= 150


@pytest.mark.parametrize("page", PAGES, ids=relative)
def test_links_resolve(page: Path) -> None:
    links = [link for link in LINK.findall(page.read_text("utf-8")) if "://" not in link and link[0] != "#"]
    missing = [link for link in links if not (page.parent / link.partition("#")[0]).exists()]
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=relative)
def test_paths_exist(page: Path) -> None:
    bases = (ROOT, ROOT / "realizer", ROOT / "tests", page.parent)
    missing = {path for path in PATH.findall(code(page)) if not any((base / path).exists() for base in bases)}
    for module in MODULE.findall(code(page)):
        path = ROOT / module.replace(".", "/")
        if not (path.is_dir() or path.with_suffix(".py").is_file()):
            missing.add(module)
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=relative)
def test_named_objects_exist(page: Path) -> None:
    text = page.read_text("utf-8")
    named = re.findall(r"`([\w/]+\.py)`\s`(\w+)`", text)
    named += [(path, name) for name, path in re.findall(r"`(\w+)`\s(?:\(|of\s+|in\s+)`([\w/]+\.py)`", text)]
    missing = [
        f"{path}: {name}"
        for path, name in named
        if not re.search(rf"^(?:def |class )?{name}\b", (ROOT / path).read_text("utf-8"), re.MULTILINE)
    ]
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=relative)
def test_named_tests_exist(page: Path) -> None:
    # A name may be shortened: `test_a_flood_...` stands for all tests that begin so.
    missing = [
        test for test in TEST.findall(page.read_text("utf-8")) if f"\n{test}" not in f"\n{known_tests()}"
    ]
    assert not missing


def test_architecture_names_every_folder() -> None:
    page = ROOT / "docs" / "architecture.md"
    if not page.is_file():
        pytest.skip("no docs beside the tests")
    named = set(PATH.findall(code(page)))
    packages = [
        path.parent for root in ("bml_schema", "realizer") for path in (ROOT / root).rglob("__init__.py")
    ]
    missing = {f"{relative(package)}/" for package in packages} - named - {"realizer/"}
    assert not missing


def test_versions_are_the_same() -> None:
    package = ROOT / "clients" / "javascript" / "package.json"
    if not package.is_file():
        pytest.skip("no JavaScript client beside the tests")
    assert json.loads(package.read_text("utf-8"))["version"] == realizer.__version__
