"""How the code is built: `python tests/benchmarks/house.py [CHECKOUT ...]` prints a table, a column each.

Counted are Python files of bml_schema, realizer and tests. An import counts wherever it stands, in functions
and for types only, too; an import from a package is one of its `__init__` unless it names a module. Files
that reach each other are a circle. A module is tested by tests/PACKAGE/test_MODULE.py. The parameters of
callbacks of commands are not counted. Below the table: the circles, and the modules of a document's and a
frame's way.

These are traced (not with --static) in a service: a document's way are its modules of which a function runs
from the message, one speech, to the first function of realizer/scheduling; a frame's way, those that run in
the callbacks that send FAPs to one client, for 20 s.
"""

from __future__ import annotations

import argparse
import ast
import asyncio
import json
import os
import re
import subprocess
import sys
from asyncio import events, selector_events
from collections import Counter
from collections.abc import Iterable, Mapping
from functools import cached_property
from pathlib import Path
from typing import Any

PACKAGES = ("bml_schema", "realizer")
SERVICE = ("server", "protocol")  # folders of realizer whose modules are on the way
LONG_NAME = 70
PART = "  realizer/"  # begins the rows of its folders
SPEECH = '<bml id="b"><speech id="s"><text>Hello there.</text></speech></bml>'


class Checkout:
    """The parsed files of a checkout."""

    def __init__(self, root: Path) -> None:
        self.root = root
        found = (path for package in (*PACKAGES, "tests") for path in (root / package).rglob("*.py"))
        inside = sorted(path.relative_to(root) for path in found)
        # Not ours: what npm installs, and faces that a wheel holds.
        self.files = [path for path in inside if not {"node_modules", "_faces"} & set(path.parts)]
        self.texts = {path: (root / path).read_text("utf-8") for path in self.files}
        self.trees = {path: ast.parse(text) for path, text in self.texts.items()}
        self.ours = [path for path in self.files if path.parts[0] in PACKAGES]
        self.tests = [path for path in self.files if path.parts[0] == "tests"]
        self.modules = {_dotted(path): path for path in self.ours}

    def lines(self, paths: Iterable[Path]) -> int:
        """Count the lines of files."""
        return sum(len(self.texts[path].splitlines()) for path in paths)

    @cached_property
    def imports(self) -> dict[Path, set[Path]]:
        """Which of our files each of them imports."""
        return {path: set(self._imported(path)) - {path} for path in self.ours}

    def _imported(self, path: Path) -> Iterable[Path]:
        for node in ast.walk(self.trees[path]):
            if isinstance(node, ast.Import):
                yield from (self.modules[a.name] for a in node.names if a.name in self.modules)
            elif isinstance(node, ast.ImportFrom):
                package = path.parts[: len(path.parts) - node.level] if node.level else ()
                source = ".".join([*package, *filter(None, [node.module])])
                for alias in node.names:
                    name = f"{source}.{alias.name}"
                    if (target := name if name in self.modules else source) in self.modules:
                        yield self.modules[target]

    @cached_property
    def circles(self) -> list[list[Path]]:
        """Files that reach each other, the largest group first."""
        reached = {path: _reach(self.imports, path) for path in self.ours}
        groups = {frozenset(p for p in reached[path] if path in reached[p]) for path in self.ours}
        return sorted((sorted(group) for group in groups if len(group) > 1), key=lambda g: (-len(g), g))

    @cached_property
    def untested(self) -> list[Path]:
        """Modules without a test module of their own name."""
        modules = [path for path in self.ours if path.name not in ("__init__.py", "__main__.py")]
        return [p for p in modules if Path("tests", *p.parts[:-1], f"test_{p.name}") not in self.tests]

    def functions(
        self, paths: Iterable[Path]
    ) -> Iterable[tuple[Path, ast.FunctionDef | ast.AsyncFunctionDef]]:
        """Yield all functions and methods."""
        for path in paths:
            for node in ast.walk(self.trees[path]):
                if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                    yield path, node

    def table(self) -> dict[str, str]:
        """Return the rows of the table."""
        rows = {}
        for package in (*PACKAGES, "tests"):
            inside = [path for path in self.files if path.parts[0] == package]
            rows[f"{package}: files, lines"] = f"{len(inside)}, {self.lines(inside):,}"
        rows["the library: files, lines"] = f"{len(self.ours)}, {self.lines(self.ours):,}"
        parts = {path.parts[1] for path in self.ours if path.parts[0] == "realizer" and len(path.parts) > 2}
        for part in sorted(parts):
            inside = [path for path in self.ours if path.parts[:2] == ("realizer", part)]
            rows[f"{PART}{part}"] = f"{len(inside)}, {self.lines(inside):,}"
        flat = Counter(path.parent for path in self.ours)
        deep = Counter(Path(*path.parts[:k]) for path in self.ours for k in range(2, len(path.parts)))
        rows["largest folders"] = _most(flat)
        rows["  with what is below them"] = _most(deep)
        rows["circles of imports: files in each"] = ", ".join(str(len(c)) for c in self.circles) or "none"
        rows["modules without a test of their name"] = (
            f"{len(self.untested)}, {self.lines(self.untested):,} lines"
        )
        lists = {
            f"{path}: {f.name}": _parameters(f) for path, f in self.functions(self.ours) if not _command(f)
        }
        rows["longest lists of parameters"] = _most(lists)
        rows["  functions with more than 8"] = str(sum(count > 8 for count in lists.values()))
        rows["longest modules, lines"] = _most({path: self.lines([path]) for path in self.ours})
        rows["empty __all__"] = str(sum(bool(EMPTY.search(self.texts[path])) for path in self.ours))
        heads = [(ast.get_docstring(self.trees[path]) or "").partition("\n\n")[0] for path in self.ours]
        rows['docstrings "X in, Y out"'] = str(sum(bool(FORMULA.search(head)) for head in heads))
        names = [f.name for _, f in self.functions(self.tests) if f.name.startswith("test_")]
        rows["tests"] = f"{len(names):,}"
        rows[f"  names above {LONG_NAME} characters"] = str(sum(len(name) > LONG_NAME for name in names))
        return rows


EMPTY = re.compile(r"^__all__(: list\[str\])? = \[\]$", re.MULTILINE)
FORMULA = re.compile(r"\bin\b.*\bout\b", re.DOTALL)


def _dotted(path: Path) -> str:
    parts = path.with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def _reach(imports: Mapping[Path, set[Path]], path: Path) -> set[Path]:
    reached: set[Path] = {path}
    left = [path]
    while left:
        new = imports[left.pop()] - reached
        reached |= new
        left += new
    return reached


def _parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    a = function.args
    names = [p.arg for p in (*a.posonlyargs, *a.args, *a.kwonlyargs)]
    return len(names) - (names[:1] in (["self"], ["cls"]))


def _command(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Whether it is the callback of a command."""
    return any(re.search(r"\b(command|group|option)\(", ast.unparse(d)) for d in function.decorator_list)


def _most(counts: Mapping[Any, int], most: int = 3) -> str:
    first = sorted(counts.items(), key=lambda item: (-item[1], str(item[0])))[:most]
    return "; ".join(f"{count} {name}" for name, count in first)


# What runs --------------------------------------------------------------------------------------------


class Trace:
    """The files of realizer of which a function runs, in order, until one of the folder `end` does.

    Args:
        writes: only what runs in a callback of the event loop that writes to a socket.
    """

    def __init__(self, root: Path, end: str = "", *, writes: bool = False) -> None:
        self.files: dict[str, None] = {}
        self._callback: dict[str, None] = {}
        self._wrote = not writes
        self._root, self._end, self._writes = f"{root / 'realizer'}{os.sep}", end, writes

    def __call__(self, frame: Any, event: str, argument: object) -> None:
        """Take what `sys.setprofile` tells."""
        if event != "call":
            return
        file, name = frame.f_code.co_filename, frame.f_code.co_name
        if file == events.__file__ and name == "_run":  # the next callback begins
            self._callback, self._wrote = {}, not self._writes
        elif file == selector_events.__file__ and name == "write":
            self._wrote = True
        elif file.startswith(self._root):
            inside = file.removeprefix(self._root)
            if self._end and inside.startswith(self._end):
                sys.setprofile(None)
                return
            self._callback[inside] = None
        if self._wrote:
            self.files |= self._callback


async def ways(root: Path) -> dict[str, list[str]]:
    """Trace a document's way and a frame's way in a service."""
    from virtual_clock import service
    from websockets.asyncio.client import connect

    async with service() as url, connect(url) as talker, connect(url) as viewer:
        for id in ("first", "b"):  # what only the first document loads is not on the way
            await asyncio.sleep(1)
            document = Trace(root, "scheduling" + os.sep)
            sys.setprofile(document)
            await talker.send(SPEECH.replace('"b"', f'"{id}"'))
            await asyncio.sleep(5)
            sys.setprofile(None)
        await talker.close()
        await viewer.send('{"type":"subscribe","stream":"fap","fps":25}')
        await asyncio.sleep(3.02)
        frame = Trace(root, writes=True)
        sys.setprofile(frame)
        await asyncio.sleep(20)
        sys.setprofile(None)
    return {"document": list(document.files), "frame": list(frame.files)}


def traced(root: Path) -> dict[str, list[str]]:
    """Return the ways in a checkout, traced by a process of its own."""
    environment = os.environ | {"PYTHONPATH": str(root), "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, str(Path(__file__).resolve()), "--trace", str(root)]
    done = subprocess.run(command, env=environment, cwd=root, stdout=subprocess.PIPE, text=True, check=True)
    return dict(json.loads(done.stdout))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    here = Path(__file__).resolve().parents[2]
    parser.add_argument("checkouts", type=Path, nargs="*", default=[here], metavar="CHECKOUT")
    parser.add_argument("--static", action="store_true", help="trace nothing")
    parser.add_argument("--untested", action="store_true", help="name the modules without a test")
    parser.add_argument("--trace", action="store_true", help=argparse.SUPPRESS)
    asked = parser.parse_args()
    roots = [root.resolve() for root in asked.checkouts]
    if asked.trace:
        from virtual_clock import run

        print(json.dumps(run(ways(roots[0]))))
        return
    checkouts = [Checkout(root) for root in roots]
    tables = [checkout.table() for checkout in checkouts]
    details: list[str] = []
    for root, checkout, table in zip(roots, checkouts, tables, strict=True):
        details += [f"\n{root}: circle of {len(c)}: {', '.join(map(str, c))}" for c in checkout.circles]
        for way, files in ({} if asked.static else traced(root)).items():
            inside = [file for file in files if file.startswith(SERVICE)]
            count = f"{len(inside)}, elsewhere {len(files) - len(inside)}"
            table[f"a {way}'s way: modules of the service"] = count
            details.append(f"\n{root}: a {way}'s way: {', '.join(files)}")
        if asked.untested:
            details += [f"{root}: no test of its name: {path}" for path in checkout.untested]
    rows = list(dict.fromkeys(name for table in tables for name in table))
    parts = sorted(row for row in rows if row.startswith(PART))
    first = min(map(rows.index, parts))
    others = [row for row in rows if row not in parts]
    rows = others[:first] + parts + others[first:]
    print("| | " + " | ".join(str(root) for root in roots) + " |")
    print("|---" * (1 + len(roots)) + "|")
    for row in rows:
        print("| " + " | ".join([row, *(table.get(row, "") for table in tables)]) + " |")
    print(*details, sep="\n")


if __name__ == "__main__":
    main()
