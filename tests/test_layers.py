"""Which package may import which, and the one package that imports each heavy library."""

from __future__ import annotations

import ast
import functools
import graphlib
import importlib.metadata
import re
import subprocess
import sys
from pathlib import Path

import pytest

import bml_schema
import realizer
import realizer_studio

# Processes of pytest-xdist would each parse all modules.
pytestmark = pytest.mark.xdist_group("layers")

ROOTS = {
    name: Path(package.__path__[0])
    for name, package in (
        ("bml_schema", bml_schema),
        ("realizer", realizer),
        ("realizer_studio", realizer_studio),
    )
}

# Each package may import itself and those to its left.
LAYERS = (
    "realizer.core realizer.examples",
    "realizer.tables",
    "bml_schema",
    "realizer.text",
    "realizer.scheduling realizer.speech",
    "realizer.animation",
    "realizer.face",
    "realizer.emotions realizer.expressions realizer.knowledge",
    "realizer.behaviours",
    "realizer.spoken_block",
    "realizer.sources",
    "realizer.render",
    "realizer.playback",
    "realizer.realization",
    "realizer.pipeline",
    "realizer.outputs realizer.charts realizer.checking",
    "realizer.result realizer.enrichment",
    "realizer.offline",
    "realizer.protocol",
    "realizer.server",
    "realizer.client realizer.asgi",
    "realizer.cli",
    "realizer.__main__",
    "realizer_studio.align realizer_studio.analysis realizer_studio.batch",
    "realizer_studio.document_panels realizer_studio.recorded_sessions",
    "realizer_studio.explained",
    "realizer_studio.tracking",
    "realizer_studio.corpus",
    "realizer_studio.faces",
    "realizer_studio.study",
    "realizer_studio.editors",
    "realizer_studio.cli",
    "realizer_studio",
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
    "regex": ("realizer.speech.words",),
    "markdown_it": ("realizer.text",),
    "lxml": ("bml_schema",),
    "trimesh": ("realizer.face", "realizer_studio.faces", "realizer_studio.editors.face"),
    "numba": ("realizer.render.compiled",),
    "moderngl": ("realizer.render.opengl",),
    "websockets": ("realizer.server", "realizer.client"),
    "av": (
        "realizer.outputs",
        "realizer.behaviours.sound_file",
        "realizer_studio.tracking.pictures",
        "realizer.server.http.tracks",
    ),
    "aiortc": ("realizer.server.http",),
    "distributed": ("realizer_studio.batch.dask_cluster",),
    "ai_edge_litert": ("realizer_studio.tracking.network",),
    "clarabel": ("realizer.scheduling",),
    "click": ("realizer.cli", "realizer_studio.cli"),
    "espeakng_loader": ("realizer.speech.espeak.espeak_worker",),
    "hibari": ("realizer.speech.hibari.voice", "realizer.speech.hibari.hibari_worker"),
    "onnxruntime": ("realizer.speech.hibari.hibari_worker",),
    "redis": ("realizer.server.journal.redis_journal",),
    "pocketsphinx": ("realizer_studio.align.sphinx",),
    "starlette": ("realizer.server.http",),
    "uvicorn": ("realizer.server.http",),
    "prometheus_client": ("realizer.server.http.metrics",),
    "h11": ("realizer.server.http.protocols",),
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


# A string that names a module, or an object in it: what import_module, a registry or resolve_name is given.
NAMED = re.compile(rf"(?:{'|'.join(ROOTS)})(?:\.\w+)*(?::\w+)?")


@functools.cache
def imports(path: Path) -> set[str]:
    """Every dotted name a file imports, also inside functions; `from a import b` counts as a.b."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            names |= {f"{node.module}.{alias.name}" for alias in node.names}
    return names


@functools.cache
def named(path: Path) -> set[str]:
    """Every module that a string of a file names, so that it could be imported by it."""
    strings = (
        node.value
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    )
    return {text.partition(":")[0] for text in strings if NAMED.fullmatch(text)}


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
            assert package != "bml_schema" or other == package, f"{name} imports {imported}: it stands alone"
            if package == "realizer.client":
                assert any(within(imported, may) for may in CLIENT), f"a client may import {sorted(CLIENT)}"


def test_imports_of_heavy_libraries_are_in_one_place() -> None:
    for name, path in modules():
        for library, importers in IMPORTERS.items():
            if any(within(i, library) for i in imports(path)):
                assert any(within(name, importer) for importer in importers), (
                    f"only {importers} may import {library}"
                )


@pytest.mark.parametrize("by", ["imports", "imports and strings"])
def test_imports_have_no_circle(by: str) -> None:
    """No two files import each other, also not inside functions, for types, by way of others or by a string.

    The rows of a registry name what is made for it, which knows the registry: they count for packages only.
    """
    known = dict(modules())
    graph: dict[str, set[str]] = {}
    for name, path in known.items():
        used = {i if i in known else i.rpartition(".")[0] for i in imports(path)}
        if by == "imports and strings":
            package = package_of(name) or name
            used = {package_of(i) or i for i in used | named(path)} - {package}
            graph.setdefault(package, set()).update(used & LEVELS.keys())
        else:
            graph[name] = used & known.keys() - {name}
    try:
        graphlib.TopologicalSorter(graph).prepare()
    except graphlib.CycleError as error:
        # The sorter lists what comes first in front: each imports the one before it.
        pytest.fail("circle of imports: " + " -> ".join(reversed(error.args[1])))


def test_what_runs_never_names_the_studio() -> None:
    for name, path in modules():
        if not within(name, "realizer_studio"):
            assert "realizer_studio" not in path.read_text("utf-8"), name


def test_entry_points_of_the_project_are_those_of_the_studio() -> None:
    """What the project finds by entry points can be deleted: all of it is the studio."""
    points = importlib.metadata.distribution("bml-realizer").entry_points
    modules = {point.group: point.module for point in points if point.group != "console_scripts"}
    assert set(modules) == {
        "realizer.aligners",
        "realizer.commands",
        "realizer.editors",
        "realizer.face_builders",
        "realizer.trackers",
    }
    assert all(within(point.module, "realizer_studio") for point in points if point.group in modules)


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
    packages = ("render", "outputs", "charts", "protocol", "server", "checking", "knowledge")
    assert [n for n in loaded if any(within(n, f"realizer.{package}") for package in packages)] == []
    assert not [n for n in loaded if within(n, "realizer_studio")]
