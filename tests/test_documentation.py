"""The code in the documentation runs, the commands exist, and the site builds without a warning."""

from __future__ import annotations

import ast
import asyncio
import inspect
import re
import shlex
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from realizer.cli import cli
from tests.programs import serving

ROOT = Path(__file__).parent.parent
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
BLOCK = re.compile(
    r"^(?:<!-- not run: (?P<why>.+) -->\n)?```(?P<language>\w+)\n(?P<code>.*?)^```$", re.M | re.S
)
# Pages whose code is an example of a plug-in, which tests/test_plugins.py installs.
PLUGINS = ("docs/adding.md",)


def blocks(page: Path, language: str) -> list[str]:
    """Return the code of a page that is meant to be run."""
    found = BLOCK.finditer(page.read_text("utf-8"))
    return [block["code"] for block in found if block["language"] == language and block["why"] is None]


def name(page: Path) -> str:
    return page.relative_to(ROOT).as_posix()


def with_code(language: str) -> list[Path]:
    return [page for page in PAGES if page.is_file() and blocks(page, language) and name(page) not in PLUGINS]


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with serving() as (address, _):
        yield address.partition("//")[2].partition("/")[0]


@pytest.mark.slow
@pytest.mark.gl
@pytest.mark.parametrize("page", with_code("python"), ids=name)
def test_code_of_a_page_runs(
    page: Path, address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    hello = next(text for text in blocks(ROOT / "docs/tutorials/first-face.md", "xml"))
    (tmp_path / "hello.bml").write_text(hello, "utf-8")
    names: dict[str, object] = {"__name__": "page"}
    for block in blocks(page, "python"):
        text = block.replace("127.0.0.1:8765", address)
        code = compile(text, name(page), "exec", flags=ast.PyCF_ALLOW_TOP_LEVEL_AWAIT)
        result = eval(code, names)
        if inspect.iscoroutine(result):
            asyncio.run(asyncio.wait_for(result, 60))


def commands(page: Path) -> Iterator[list[str]]:
    """Yield the words of each call of the command line on a page, also within a sentence."""
    text = page.read_text("utf-8")
    known = "|".join(cli.list_commands(click.Context(cli)))
    for words in re.findall(rf"(?<!`)`(?:realizer )?((?:{known}) --[^`\n]+)`", text):
        yield words.split()
    for block in blocks(page, "sh"):
        for line in block.replace("\\\n", " ").splitlines():
            for part in re.split(r"&&|\|(?!\|)", line):
                words = shlex.split(part, comments=True)
                while words and ("=" in words[0] or words[0] in ("nice", "time")):
                    words = words[1:]
                if words and Path(words[0]).name == "realizer":
                    yield words[1:]


@pytest.mark.parametrize("page", [page for page in PAGES if page.is_file()], ids=name)
def test_commands_of_a_page_exist(page: Path) -> None:
    wrong = [" ".join(words) for words in commands(page) if unknown_words(words)]
    assert not wrong


def unknown_words(words: list[str]) -> list[str]:
    """Return the commands and options of a call that do not exist."""
    command: click.Command = cli
    while isinstance(command, click.Group) and words and not words[0].startswith("-"):
        found = command.get_command(click.Context(command), words[0])
        if found is None:
            return [words[0]]
        command, words = found, words[1:]
    known = {
        option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)
    }
    known |= {"-h", "--help"}
    return [word for word in words if re.match(r"--?[a-z]", word) and word.partition("=")[0] not in known]


@pytest.mark.slow
def test_site_builds_without_a_warning(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs")
    if not (ROOT / "mkdocs.yml").is_file():
        pytest.skip("no mkdocs.yml beside the tests")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--quiet", "--site-dir", str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "mermaid" not in (tmp_path / "blocks.html").read_text("utf-8")
    assert (tmp_path / "generated" / "bml.html").stat().st_size > 50_000
    elsewhere = re.compile(r'<(?:script|link|img)[^>]+(?:src|href)="(https?:)?//')
    assert not [page for page in tmp_path.rglob("*.html") if elsewhere.search(page.read_text("utf-8"))]
