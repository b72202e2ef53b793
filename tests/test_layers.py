"""Which package may import which, and the one package that imports each heavy library."""

from __future__ import annotations

import ast
import functools
import graphlib
import subprocess
import sys
from pathlib import Path

import pytest

import bml_schema
import realizer

# Processes of pytest-xdist would each parse all modules.
pytestmark = pytest.mark.xdist_group("layers")

ROOTS = {"bml_schema": Path(bml_schema.__path__[0]), "realizer": Path(realizer.__path__[0])}

# Each package may import itself and those to its left.
LAYERS = (
    "realizer.core realizer.examples",
    "realizer.tables",
    "bml_schema",
    "realizer.scheduling realizer.speech realizer.sources",
    "realizer.animation",
    "realizer.face",
    "realizer.emotions realizer.expressions realizer.knowledge",
    "realizer.behaviours",
    "realizer.render",
    "realizer.analysis",
    "realizer.playback",
    "realizer.realization",
    "realizer.pipeline",
    "realizer.outputs realizer.charts realizer.checking",
    "realizer.tracking",
    "realizer.result realizer.enrichment",
    "realizer.offline realizer.explained realizer.corpus",
    "realizer.protocol",
    "realizer.server",
    "realizer.facebuild",
    "realizer.study",
    "realizer.batch realizer.client realizer.asgi",
    "realizer.cli",
    "realizer.__main__",
)
LEVELS = {package: level for level, packages in enumerate(LAYERS) for package in packages.split()}
# Clients load no engine: the messages, the frames and the language are all they share with the service.
CLIENT = {
    "bml_schema",
    "realizer.client",
    "realizer.core",
    "realizer.outputs.film",
    "realizer.protocol",
}

# The packages or modules that may import a heavy library.
IMPORTERS = {
    "lxml": ("bml_schema",),
    "trimesh": ("realizer.face", "realizer.facebuild"),
    "numba": ("realizer.render.compiled",),
    "moderngl": ("realizer.render.opengl",),
    "websockets": ("realizer.server", "realizer.client"),
    "av": (
        "realizer.outputs",
        "realizer.behaviours.sound_file",
        "realizer.tracking.pictures",
        "realizer.server.http.tracks",
    ),
    "aiortc": ("realizer.server.http",),
    "distributed": ("realizer.batch.dask_cluster",),
    "ai_edge_litert": ("realizer.tracking.network",),
    "clarabel": ("realizer.scheduling",),
    "click": ("realizer.cli",),
    "espeakng_loader": ("realizer.speech.espeak.worker",),
    "hibari": ("realizer.speech.hibari.voice", "realizer.speech.hibari.worker"),
    "onnxruntime": ("realizer.speech.hibari.worker",),
    "redis": ("realizer.server.journal.redis_journal",),
    "pocketsphinx": ("realizer.speech.align.sphinx",),
    "starlette": ("realizer.server.http",),
    "stomp": ("realizer.server.transports.broker",),
    "jwt": ("realizer.server.http.access",),
    "cryptography": ("realizer.server.http.access",),
}


def modules() -> list[tuple[str, Path]]:
    found = []
    for name, root in ROOTS.items():
        for path in sorted(root.rglob("*.py")):
            parts = path.relative_to(root).with_suffix("").parts
            if "node_modules" in parts or "_faces" in parts:
                continue
            dotted = ".".join([name, *(p for p in parts if p != "__init__")])
            found.append((dotted, path))
    return found


@functools.cache
def imports(path: Path) -> set[str]:
    """Every dotted name a file imports, also inside functions; `from a import b` counts as a.b and a."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


def within(name: str, package: str) -> bool:
    return name == package or name.startswith(package + ".")


def package_of(name: str) -> str | None:
    return max((package for package in LEVELS if within(name, package)), key=len, default=None)


def test_imports_point_to_the_left() -> None:
    for name, path in modules():
        if name == "realizer":
            continue  # The root hands names out, lazily.
        package = package_of(name)
        assert package, f"{name} belongs to no layer"
        for imported in imports(path):
            other = package_of(imported)
            if other is None:
                continue  # another's library, or the version
            left = LEVELS[other] < LEVELS[package]
            assert left or other == package, f"{name} imports {imported}, which is not to its left"
            if package == "realizer.client":
                assert any(within(imported, may) for may in CLIENT), f"a client may import {sorted(CLIENT)}"


def test_imports_of_heavy_libraries_are_in_one_place() -> None:
    for name, path in modules():
        for library, importers in IMPORTERS.items():
            if any(within(i, library) for i in imports(path)):
                assert any(within(name, importer) for importer in importers), (
                    f"only {importers} may import {library}"
                )


def test_imports_have_no_circle() -> None:
    """No two files import each other, also not inside functions, for types or by way of others."""
    known = dict(modules())
    graph = {
        name: {i if i in known else i.rpartition(".")[0] for i in imports(path)} & known.keys() - {name}
        for name, path in known.items()
    }
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        # The sorter lists what comes first in front: each imports the one before it.
        pytest.fail("circle of imports: " + " -> ".join(reversed(error.args[1])))


def test_the_command_line_starts_without_the_heavy_libraries() -> None:
    code = "import sys, realizer, realizer.cli; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    heavy = {"scipy", "trimesh", "moderngl", "av", "clarabel", "websockets", "asyncio", "PIL", "pydantic"}
    assert not heavy & {name.split(".")[0] for name in loaded}


def test_a_document_is_scheduled_without_loading_what_draws() -> None:
    code = (
        "import sys, realizer\n"
        'realizer.schedule(\'<bml id="b"><head id="h" lexeme="NOD"/></bml>\')\n'
        "print(*sys.modules)"
    )
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    heavy = {"scipy", "trimesh", "moderngl", "av", "PIL", "pydantic"}
    assert not heavy & {name.split(".")[0] for name in loaded}


def test_client_loads_no_engine() -> None:
    code = "import sys, realizer.client; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    ours = {name for name in loaded if within(name, "realizer")} - {"realizer", "realizer.core"}
    # Beside the client itself: the messages, the frames, and the array types and errors of all packages.
    # Feedback quotes behaviours, so that all of the language is there too.
    assert {name for name in ours if not within(name, "realizer.client")} == {
        "realizer.core.array_types",
        "realizer.core.errors",
        "realizer.protocol",
        "realizer.protocol.messages",
        "realizer.protocol.messages.common",
        "realizer.protocol.streams",
        "realizer.protocol.wire",
    }
    heavy = {"scipy", "trimesh", "moderngl", "av", "PIL", "websockets"}
    assert not heavy & {name.split(".")[0] for name in loaded}


def test_document_is_realized_without_loading_what_draws_or_serves() -> None:
    speech = '<bml id="b"><speech id="s"><text>Hi.</text></speech></bml>'
    code = f"import sys, realizer; realizer.realize({speech!r}, voice='silent'); print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    packages = ("render", "outputs", "charts", "protocol", "server", "facebuild", "checking", "knowledge")
    assert [n for n in loaded if any(within(n, f"realizer.{package}") for package in packages)] == []
