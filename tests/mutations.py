"""Changes the library in random places, one at a time, and prints the changes that no test notices.

Run: python -m tests.mutations [--count 60] [--seed 0] [--module realizer/playback] [--jobs 2]

A module is drawn first, then a place in it. A seed draws the same places of a module until that module
changes. Each change is made in a copy of the checkout. The test module of the same name runs there, then the
tests of the package and those that import the module, then those beside the package and the corpus, up to the
first that fails.
"""

from __future__ import annotations

import argparse
import ast
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from itertools import zip_longest
from operator import itemgetter
from pathlib import Path
from queue import SimpleQueue
from random import Random

__all__ = ["ROOT", "Mutation", "mutations", "sample", "steps"]

ROOT = Path(__file__).parents[1]
PACKAGES = ("bml_schema", "realizer")
LIMIT = 1200  # s for the tests of one step; what takes longer hangs
LEFT_OUT = (".git", ".venv", "node_modules", "__pycache__", ".*_cache")
# Documents of the corpus play through these.
CORE = re.compile(
    "bml_schema/|realizer/(animation|behaviours|emotions|expressions|playback|scheduling|speech|tables)/"
)
OPERATORS = {
    ast.Lt: ("<", ">="), ast.LtE: ("<=", ">"), ast.Gt: (">", "<="), ast.GtE: (">=", "<"),
    ast.Eq: ("==", "!="), ast.NotEq: ("!=", "=="), ast.Is: ("is", "is not"), ast.IsNot: ("is not", "is"),
    ast.In: ("in", "not in"), ast.NotIn: ("not in", "in"), ast.And: ("and", "or"), ast.Or: ("or", "and"),
    ast.Add: ("+", "-"), ast.Sub: ("-", "+"), ast.Mult: ("*", "/"), ast.Div: ("/", "*"),
}  # fmt: skip
# Messages for people, and calls that release something that nobody waits for.
UNSEEN = re.compile(r"(log|logging|warnings|gc)\.|.*\.(close|cancel|shutdown|kill|flush)$|print$")
# Errors, whose texts are for people too.
ERRORS = re.compile(r"(\w+\.)*\w*Error$")
# Arguments that only speed, memory or the look of a text depend on.
TUNING = {"maxsize", "maxlen", "timeout", "indent", "stacklevel", "max_workers", "limit", "ndigits", "repr"}
# Numbers and sums there are a matter of taste: where a curl lies, how thick a line is.
TASTE = re.compile("realizer/(charts|facebuild/person)/")
# Numbers so small only keep rounding errors and divisions by 0 out; those so large are limits, and one more
# or less is the same to all who stay below them.
TOLERANCE, LIMIT_OF_MANY = 5e-6, 1000
WIDEST = 1e6  # metres, seconds and the like only have limits there
# Limits of pydantic for what clients send; those beyond BOUND only keep nonsense out.
LIMITS, BOUND = {"ge", "gt", "le", "lt", "min_length", "max_length"}, 100
# Which random numbers are drawn, how pictures are compressed: other numbers would do.
FREE = {"SEED", "QUALITY", "METHOD"}
NO_CODE = {"annotation", "returns", "decorator_list", "bases"}


@dataclass(frozen=True)
class Mutation:
    """Other text for a piece of a file, from byte `start` to `end`."""

    path: str
    line: int
    start: int
    end: int
    before: str
    after: str

    def __str__(self) -> str:
        before, after = (" ".join(text.split()) for text in (self.before, self.after))
        return f"{self.path}:{self.line}: {before[:70]} -> {after[:70]}"

    def apply(self, source: bytes) -> bytes:
        """Return the file with the other text."""
        return source[: self.start] + self.after.encode() + source[self.end :]


def mutations(path: str, source: bytes) -> Iterator[Mutation]:
    """Yield every mutation of a file that is worth a try."""
    offsets = [0]
    for line in source.splitlines(keepends=True):
        offsets.append(offsets[-1] + len(line))

    def piece(line: int, start: int, end: int, after: str) -> Mutation:
        return Mutation(path, line, start, end, source[start:end].decode(), after)

    def instead(node: ast.expr | ast.stmt, after: str) -> Mutation:
        start, end = (offsets[a - 1] + b for a, b in (_begin(node), _end(node)))
        return piece(node.lineno, start, end, after)

    def between(left: ast.expr, operator: ast.AST, right: ast.expr) -> Mutation:
        start, end = (offsets[a - 1] + b for a, b in (_end(left), _begin(right)))
        before, after = OPERATORS[type(operator)]
        words = r"\s+".join(map(re.escape, before.split()))
        return piece(left.lineno, start, end, re.sub(words, after, source[start:end].decode(), count=1))

    for node in _nodes(ast.parse(source)):
        match node:
            case ast.Compare(left=left, ops=[op], comparators=[right]):
                yield between(left, op, right)
            case ast.BoolOp(op=op, values=[left, right, *_]):
                yield between(left, op, right)
            case ast.BinOp(left=left, op=op, right=right):
                if type(op) in OPERATORS and not (TASTE.match(path) or _is_sequence(node)):
                    yield between(left, op, right)
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                yield instead(node, f"({ast.unparse(operand)})")
            case ast.If(test=ast.Name() | ast.Attribute() | ast.Call() as test):
                yield instead(test, f"not {ast.unparse(test)}")
            case ast.Constant(value=bool() as value):
                yield instead(node, str(not value))
            case ast.Constant(value=int() | float() as value) if not (
                TASTE.match(path) or _is_tolerance(value)
            ):
                yield instead(node, str(value + 1 if isinstance(value, int) else 2 * value or 1.0))
            case ast.AugAssign():
                yield instead(node, "pass")
            case ast.Expr(value=ast.Call()):
                yield instead(node, "pass")


def _begin(node: ast.expr | ast.stmt) -> tuple[int, int]:
    return node.lineno, node.col_offset


def _end(node: ast.expr | ast.stmt) -> tuple[int, int]:
    assert node.end_lineno is not None
    assert node.end_col_offset is not None
    return node.end_lineno, node.end_col_offset


def _is_tolerance(value: float) -> bool:
    return 0 < value < TOLERANCE or value >= (LIMIT_OF_MANY if isinstance(value, int) else WIDEST)


def _nodes(tree: ast.AST) -> Iterator[ast.AST]:
    """Yield what runs, and what somebody notices."""
    for field, value in ast.iter_fields(tree):
        if field in NO_CODE or (field == "keywords" and _is_zip(tree)):
            continue
        for node in value if isinstance(value, list) else [value]:
            if isinstance(node, ast.AST) and not _is_unseen(node):
                yield node
                yield from _nodes(node)


def _is_unseen(node: ast.AST) -> bool:
    match node:
        case ast.Raise() | ast.Assert() | ast.JoinedStr():
            return True
        case ast.Expr(value=ast.Call(func=func)):
            return bool(UNSEEN.match(ast.unparse(func)))
        case ast.Call(func=func):
            return bool(ERRORS.match(ast.unparse(func)))
        case ast.If(test=test):
            return bool(re.search("TYPE_CHECKING|__name__", ast.unparse(test)))
        case ast.BinOp(left=ast.Constant(value=2), op=ast.Pow(), right=ast.Constant(value=int() as power)):
            return _is_tolerance(2**power)
        case ast.ExceptHandler(type=ast.expr() as kind):
            return "ImportError" in ast.unparse(kind)
        case ast.keyword(arg=str() as name, value=value):
            return name in TUNING or (name in LIMITS and _is_bound(value))
        case ast.FunctionDef(name=name):
            return name == "__repr__"
        case ast.Assign(targets=[ast.Name() | ast.Tuple() as target]):
            return {n.id for n in ast.walk(target) if isinstance(n, ast.Name)} <= FREE
    return False


def _is_zip(node: ast.AST) -> bool:
    """Return whether a call's keyword is `strict` of `zip`: a check, as an assertion is."""
    return isinstance(node, ast.Call) and ast.unparse(node.func) == "zip"


def _is_bound(value: ast.expr) -> bool:
    number = value.operand if isinstance(value, ast.UnaryOp) else value
    return isinstance(number, ast.Constant) and isinstance(number.value, int | float) and number.value > BOUND


def _is_sequence(node: ast.AST) -> bool:
    """Return whether an operation joins texts or lists: every mutation of it fails at once."""
    kinds = (ast.JoinedStr, ast.List, ast.Tuple, ast.ListComp)
    return any(
        isinstance(n, kinds) or isinstance(getattr(n, "value", 0), str | bytes) for n in ast.walk(node)
    )


# tests ------------------------------------------------------------------------------------------


def steps(path: str) -> list[list[str]]:
    """Return the tests that map to a module: the nearest ones first, none twice."""
    module = Path(path)
    package = Path("tests") / module.parent
    found = [
        [package / f"test_{module.stem}.py"],
        [*sorted((ROOT / package).glob("test_*.py")), *importers(".".join(module.with_suffix("").parts))],
        [*sorted((ROOT / package.parent).glob("test_*.py")), *corpus(path)],
    ]
    seen: set[Path] = set()
    named = []
    for step in found:
        new = [p for p in dict.fromkeys(ROOT / p for p in step) if p.is_file() and p not in seen]
        seen.update(new)
        if new:
            named.append([p.relative_to(ROOT).as_posix() for p in new])
    return named


def corpus(path: str) -> list[Path]:
    """Return the test that plays all documents, where they play through a module."""
    return [Path("tests/test_corpus.py")] if CORE.match(path) or path.count("/") == 1 else []


def importers(module: str) -> list[Path]:
    """Return the test modules that import a module."""
    package, _, name = module.removesuffix(".__init__").rpartition(".")
    words = rf"^\s*from {re.escape(package)}(\.{name}(\.\w+)* import| import.*\b{name}\b)"
    return [path for path, text in _tests() if re.search(words, text, re.M)]


@cache
def _tests() -> list[tuple[Path, str]]:
    paths = sorted((ROOT / "tests").rglob("test_*.py"))
    return [(path, path.read_text("utf-8")) for path in paths]


# runs -------------------------------------------------------------------------------------------


class Copy:
    """A copy of the checkout in which a module can be changed."""

    def __init__(self, folder: Path) -> None:
        self.root = folder / "checkout"
        shutil.copytree(ROOT, self.root, ignore=shutil.ignore_patterns(*LEFT_OUT), symlinks=True)
        # Compiled files that know the text they are of: a module is changed and restored within a second.
        command = [sys.executable, "-m", "compileall", "-q", "--invalidation-mode", "checked-hash"]
        subprocess.run([*command, *PACKAGES], cwd=self.root, check=True)

    def survives(self, mutation: Mutation) -> bool:
        """Return whether no test fails of a mutation.

        Raises:
            SystemExit: a test that fails does so without it as well.
        """
        path = self.root / mutation.path
        source = path.read_bytes()
        for step in steps(mutation.path):
            path.write_bytes(mutation.apply(source))
            try:
                status, _ = self.run(*step)
            finally:
                path.write_bytes(source)
            if status == 0:
                continue
            if status is not None:
                status, output = self.run(*step, "--last-failed")
                if status != 0:
                    raise SystemExit(f"fails without any mutation too:\n{output}")
            return False
        return True

    def run(self, *arguments: str) -> tuple[int | None, str]:
        """Run tests up to the first that fails; the status is None where they hang."""
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-m", "", *arguments]
        environment = {**os.environ, "PYTHONPATH": str(self.root)}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)  # so that test modules are rewritten once only
        pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.STDOUT}
        with subprocess.Popen(
            command, cwd=self.root, env=environment, text=True, start_new_session=True, **pipes
        ) as tests:
            try:
                output, _ = tests.communicate(timeout=LIMIT)
            except subprocess.TimeoutExpired:
                os.killpg(tests.pid, signal.SIGKILL)
                return None, ""
        return tests.returncode, output


def sample(count: int, seed: int, prefix: str) -> list[Mutation]:
    """Return some mutations, each once, of modules under a path: one of each module before the second of any.

    Each module has its own random numbers, so that a change to one leaves what is drawn of the others.
    """
    paths = [p for package in PACKAGES for p in sorted((ROOT / package).rglob("*.py"))]
    names = [p.relative_to(ROOT).as_posix() for p in paths if "node_modules" not in p.parts]
    drawn: list[tuple[float, list[Mutation]]] = []
    for name in names:
        if name.startswith(prefix):
            random, found = Random(f"{seed} {name}"), list(mutations(name, (ROOT / name).read_bytes()))
            drawn.append((random.random(), random.sample(found, len(found))))
    rounds = zip_longest(*(found for _, found in sorted(drawn, key=itemgetter(0))))
    return [mutation for one in rounds for mutation in one if mutation is not None][:count]


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.mutations", description=__doc__)
    parser.add_argument("--count", type=int, default=60, help="how many mutations (60)")
    parser.add_argument("--seed", type=int, default=0, help="which ones (0)")
    parser.add_argument("--module", default="", help="a module or a folder, such as realizer/playback")
    parser.add_argument("--jobs", type=int, default=1, help="how many at a time (1)")
    asked = parser.parse_args()
    chosen = sample(asked.count, asked.seed, asked.module)
    copies: SimpleQueue[Copy] = SimpleQueue()
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(asked.jobs) as pool:
        for job in range(asked.jobs):
            copies.put(Copy(Path(folder) / str(job)))

        def tried(mutation: Mutation) -> bool:
            copy = copies.get()
            try:
                return copy.survives(mutation)
            finally:
                copies.put(copy)

        survivors = []
        for number, (mutation, survives) in enumerate(zip(chosen, pool.map(tried, chosen), strict=True), 1):
            print(f"{number:3} {'SURVIVES' if survives else 'caught'} {mutation}", flush=True)
            survivors += [mutation] * survives
    print(f"{len(survivors)} of {len(chosen)} mutations of seed {asked.seed} survive", *survivors, sep="\n")


if __name__ == "__main__":
    main()
