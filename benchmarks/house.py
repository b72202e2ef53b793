"""Measures the structure of the code: `python benchmarks/house.py [CHECKOUT ...]` prints a table.

The table counts Python files of the packages, tests, benchmarks and training scripts. All imports count, also
those in functions and for types; an import from a package counts for its `__init__`, unless it names a
module. Files that import each other, directly or not, form a circle. The tests of a module are in
tests/PACKAGE/test_MODULE.py. Parameters of commands do not count. Below the table are the circles, and the
paths of a document and of a frame.

The paths are traced in a service (not with --static). The path of a document has the modules that run between
the receipt of a speech and the first function of realizer/scheduling; the path of a frame has those that run
in the callbacks that send FAPs to one client, for 20 s.
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

PACKAGES = ("bml_schema", "realizer", "realizer_studio")
ENGINE = PACKAGES[:2]
BESIDE = ("tests", "benchmarks", "training")
SERVICE = ("server", "protocol")  # folders of realizer that are counted in the paths
LONG_NAME = 70
PART = "  realizer/"  # prefix of the rows of its folders
SPEECH = '<bml id="b"><speech id="s"><text>Hello there.</text></speech></bml>'


class Checkout:
    """The parsed files of a checkout."""

    def __init__(self, root: Path) -> None:
        self.root = root
        found = (path for package in (*PACKAGES, *BESIDE) for path in (root / package).rglob("*.py"))
        inside = sorted(path.relative_to(root) for path in found)
        # Without the packages of npm, and the faces in a wheel.
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
        """File of ours -> the files of ours that it imports."""
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
        """Groups of files that import each other, the largest group first."""
        return _circles(self.imports)

    @cached_property
    def circles_by_string(self) -> list[list[Path]]:
        """Groups of folders that import each other, or name each other's modules in strings."""
        graph: dict[Path, set[Path]] = {}
        for path in self.ours:
            strings = (
                node.value.partition(":")[0]
                for node in ast.walk(self.trees[path])
                if isinstance(node, ast.Constant) and isinstance(node.value, str)
            )
            named = {self.modules[text] for text in strings if "." in text and text in self.modules}
            folder = Path(*path.parts[:2])  # a module beside the folders, such as pipeline.py, is its own
            graph.setdefault(folder, set()).update(Path(*p.parts[:2]) for p in self.imports[path] | named)
        root = Path("realizer/__init__.py")  # it hands names out, lazily
        return _circles({folder: used - {root} for folder, used in graph.items() if folder != root})

    @cached_property
    def untested(self) -> list[Path]:
        """Modules without a test module of their name."""
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
        for package in (*PACKAGES, *BESIDE):
            inside = [path for path in self.files if path.parts[0] == package]
            rows[f"{package}: files, lines"] = f"{len(inside)}, {self.lines(inside):,}"
        engine = [path for path in self.ours if path.parts[0] in ENGINE]
        rows["the engine: files, lines"] = f"{len(engine)}, {self.lines(engine):,}"
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
        rows["  of folders, by strings too"] = (
            "; ".join(" ".join(map(str, circle)) for circle in self.circles_by_string) or "none"
        )
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


def _circles(imports: Mapping[Path, set[Path]]) -> list[list[Path]]:
    reached = {path: _reach(imports, path) for path in imports}
    groups = {frozenset(p for p in reached[path] if path in reached[p]) for path in imports}
    return sorted((sorted(group) for group in groups if len(group) > 1), key=lambda g: (-len(g), g))


def _parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    a = function.args
    names = [p.arg for p in (*a.posonlyargs, *a.args, *a.kwonlyargs)]
    return len(names) - (names[:1] in (["self"], ["cls"]))


def _command(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Return whether it is the callback of a command."""
    return any(re.search(r"\b(command|group|option)\(", ast.unparse(d)) for d in function.decorator_list)


def _most(counts: Mapping[Any, int], limit: int = 3) -> str:
    first = sorted(counts.items(), key=lambda item: (-item[1], str(item[0])))[:limit]
    return "; ".join(f"{count} {name}" for name, count in first)


# Traces --------------------------------------------------------------------------------------------


class Trace:
    """Collects the files of realizer whose functions run, in order, until one in the folder `end` runs.

    Args:
        writes: collect only files in callbacks of the event loop that write to a socket.
    """

    def __init__(self, root: Path, end: str = "", *, writes: bool = False) -> None:
        self.files: dict[str, None] = {}
        self._callback: dict[str, None] = {}
        self._wrote = not writes
        self._root, self._end, self._writes = f"{root / 'realizer'}{os.sep}", end, writes

    def __call__(self, frame: Any, event: str, argument: object) -> None:
        """Handle an event of `sys.setprofile`."""
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


async def trace_paths(root: Path) -> dict[str, list[str]]:
    """Trace the paths of a document and of a frame in a service."""
    from virtual_clock import service
    from websockets.asyncio.client import connect

    import realizer.server.serve  # noqa: F401

    # What is done now and then for all sessions, or by pings, is not on the paths.
    for module in list(sys.modules.values()):
        if hasattr(module, "EXPIRY_INTERVAL"):
            module.EXPIRY_INTERVAL = 1e6
    quiet: dict[str, Any] = {"ping_interval": None}
    async with service() as url, connect(url, **quiet) as sender, connect(url, **quiet) as viewer:
        for id in ("first", "b"):  # the first document loads modules that the second does not need
            await asyncio.sleep(1)
            document = Trace(root, "scheduling" + os.sep)
            sys.setprofile(document)
            await sender.send(SPEECH.replace('"b"', f'"{id}"'))
            await asyncio.sleep(5)
            sys.setprofile(None)
        await sender.close()
        await viewer.send('{"type":"subscribe","stream":"fap","fps":25}')
        await asyncio.sleep(3.02)
        frame = Trace(root, writes=True)
        sys.setprofile(frame)
        await asyncio.sleep(20)
        sys.setprofile(None)
    return {"document": list(document.files), "frame": list(frame.files)}


def traced(root: Path) -> dict[str, list[str]]:
    """Return the paths in a checkout, traced in a separate process."""
    environment = os.environ | {"PYTHONPATH": str(root), "OPENBLAS_NUM_THREADS": "1"}
    command = [sys.executable, str(Path(__file__).resolve()), "--trace", str(root)]
    done = subprocess.run(command, env=environment, cwd=root, stdout=subprocess.PIPE, text=True, check=True)
    return dict(json.loads(done.stdout))


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    here = Path(__file__).resolve().parents[1]
    parser.add_argument("checkouts", type=Path, nargs="*", default=[here], metavar="CHECKOUT")
    parser.add_argument("--static", action="store_true", help="trace nothing")
    parser.add_argument("--untested", action="store_true", help="name the modules without a test")
    parser.add_argument("--trace", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args()
    roots = [root.resolve() for root in options.checkouts]
    if options.trace:
        from virtual_clock import run

        print(json.dumps(run(trace_paths(roots[0]))))
        return
    checkouts = [Checkout(root) for root in roots]
    tables = [checkout.table() for checkout in checkouts]
    details: list[str] = []
    for root, checkout, table in zip(roots, checkouts, tables, strict=True):
        details += [f"\n{root}: circle of {len(c)}: {', '.join(map(str, c))}" for c in checkout.circles]
        for item, files in ({} if options.static else traced(root)).items():
            inside = [file for file in files if file.startswith(SERVICE)]
            count = f"{len(inside)}, elsewhere {len(files) - len(inside)}"
            table[f"path of a {item}: modules of the service"] = count
            details.append(f"\n{root}: path of a {item}: {', '.join(files)}")
        if options.untested:
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
