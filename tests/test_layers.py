"""Who may import whom, and which heavy library has which door."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import bml_schema
import realizer

ROOTS = {"bml_schema": Path(bml_schema.__path__[0]), "realizer": Path(realizer.__path__[0])}

# What each part may import of ours, the longest matching prefix counts. "*" is anything.
VALUES = {"realizer.arrays", "realizer.colours", "realizer.errors", "realizer.units"}
MAY: dict[str, set[str]] = {
    "bml_schema": {"bml_schema"},
    "realizer.arrays": set(),
    "realizer.colours": {"realizer.arrays"},
    "realizer.errors": set(),
    "realizer.logs": set(),
    "realizer.units": set(),
    "realizer.settings": {"realizer.errors"},
    "realizer.examples": set(),
    "realizer.tables": VALUES | {"realizer.tables"},
    "realizer.scheduling": VALUES | {"bml_schema", "realizer.scheduling"},
    "realizer.speech": VALUES | {"realizer.speech", "realizer.tables"},
    "realizer.animation": VALUES
    | {"realizer.animation", "realizer.speech.accents", "realizer.speech.utterance", "realizer.tables"},
    "realizer.behaviours": VALUES
    | {
        "bml_schema",
        "realizer.animation",
        "realizer.behaviours",
        "realizer.emotion",
        "realizer.expressions",
        "realizer.scheduling.timing",
        "realizer.speech.utterance",
        "realizer.tables",
    },
    "realizer.emotion": VALUES | {"realizer.emotion", "realizer.face", "realizer.tables"},
    "realizer.expressions": VALUES | {"realizer.expressions", "realizer.tables"},
    "realizer.expressions.likeness": VALUES
    | {
        "realizer.animation",
        "realizer.expressions",
        "realizer.face",
        "realizer.mapping",
        "realizer.render",
    },
    "realizer.face": VALUES | {"realizer.face", "realizer.tables"},
    "realizer.render": VALUES | {"realizer.face", "realizer.render", "realizer.tables"},
    "realizer.knowledge": VALUES
    | {
        "bml_schema",
        "realizer.knowledge",
        "realizer.speech.spelling",
        "realizer.speech.words",
        "realizer.tables",
    },
    "realizer.outputs": VALUES
    | {
        "realizer.animation",
        "realizer.composition.playing",
        "realizer.face",
        "realizer.outputs",
        "realizer.realization",
        "realizer.render",
        "realizer.scheduling.timing",
        "realizer.speech.utterance",
        "realizer.tables",
    },
    "realizer.charts": VALUES
    | {
        "bml_schema",
        "realizer.charts",
        "realizer.composition",
        "realizer.outputs.files",
        "realizer.scheduling.timing",
    },
    "realizer.mapping": VALUES | {"realizer.animation", "realizer.face", "realizer.tables"},
    "realizer.planning": VALUES
    | {
        "bml_schema",
        "realizer.animation",
        "realizer.behaviours",
        "realizer.composition.claims",
        "realizer.scheduling",
        "realizer.speech.utterance",
    },
    "realizer.composition": VALUES
    | {
        "bml_schema",
        "realizer.animation",
        "realizer.behaviours",
        "realizer.composition",
        "realizer.planning",
        "realizer.scheduling",
        "realizer.speech.utterance",
    },
    "realizer.player": VALUES
    | {
        "bml_schema",
        "realizer.animation",
        "realizer.behaviours",
        "realizer.composition",
        "realizer.expressions",
        "realizer.scheduling",
        "realizer.speech.utterance",
        "realizer.tables.cooccurrence",
    },
    "realizer.scene": {"realizer.behaviours.kind"},
    "realizer.sound": VALUES | {"realizer.animation.curves", "realizer.composition.playing"},
    "realizer.realization": VALUES
    | {
        "bml_schema",
        "realizer.animation",
        "realizer.composition.playing",
        "realizer.face",
        "realizer.player",
        "realizer.scheduling.timing",
        "realizer.sound",
        "realizer.speech.utterance",
        "realizer.tables",
    },
    "realizer.pipeline": VALUES
    | {
        "bml_schema",
        "realizer.animation",
        "realizer.behaviours",
        "realizer.face",
        "realizer.mapping",
        "realizer.player",
        "realizer.realization",
        "realizer.scheduling",
        "realizer.speech",
    },
    "realizer.checking": VALUES
    | {
        "bml_schema",
        "realizer.behaviours",
        "realizer.checking",
        "realizer.pipeline",
        "realizer.player",
        "realizer.scheduling.timing",
        "realizer.speech",
        "realizer.tables",
    },
    "realizer.batch": VALUES
    | {
        "bml_schema",
        "realizer.batch",
        "realizer.behaviours.kind",
        "realizer.face",
        "realizer.outputs",
        "realizer.pipeline",
        "realizer.realization",
        "realizer.render",
        "realizer.speech",
    },
    "realizer.client": VALUES
    | {
        "bml_schema",
        "realizer.client",
        "realizer.outputs.files",
        "realizer.outputs.film",
        "realizer.server.messages",
        "realizer.server.wire",
    },
    "realizer.server": {"*"},
    "realizer.cli": {"*"},
    "realizer.__main__": {"realizer.cli"},
    "realizer": {"*"},  # the root hands names out, lazily
}

# The one package (or module) that may import a heavy library.
DOORS = {
    "lxml": ("bml_schema",),
    "trimesh": ("realizer.face",),
    "numba": ("realizer.render.raster",),
    "pyrender": ("realizer.render.offscreen",),
    "websockets": ("realizer.server", "realizer.client"),
    "av": ("realizer.outputs", "realizer.behaviours.sound_file"),
    "distributed": ("realizer.batch.cluster",),
    "clarabel": ("realizer.scheduling",),
    "click": ("realizer.cli",),
    "espeakng_loader": ("realizer.speech.espeak_worker",),
    "hibari": ("realizer.speech.hibari", "realizer.speech.hibari_worker"),
    "onnxruntime": ("realizer.speech.hibari_worker",),
    "redis": ("realizer.server.journal.shared",),
    "pocketsphinx": ("realizer.speech.align.sphinx",),
    "stomp": ("realizer.server.doors.broker",),
    "jwt": ("realizer.server.passes",),
    "cryptography": ("realizer.server.passes",),
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


@pytest.mark.parametrize(("name", "path"), modules(), ids=[name for name, _ in modules()])
def test_imports_point_downwards(name: str, path: Path) -> None:
    rule = max((package for package in MAY if within(name, package)), key=len)
    if "*" in MAY[rule]:
        return
    # The bare root is a folder and a version; what it hands out is imported by its own name.
    ours = {i for i in imports(path) if i.split(".")[0] in ROOTS and i != "realizer"}
    bad = {i for i in ours if not any(within(i, may) for may in MAY[rule]) and i != "realizer.tables"}
    allowed = {i for i in bad if i.rpartition(".")[0] == "realizer" and i in MAY[rule]}
    assert not bad - allowed, f"{name} may import {sorted(MAY[rule])}"


@pytest.mark.parametrize(("name", "path"), modules(), ids=[name for name, _ in modules()])
def test_heavy_libraries_have_one_door(name: str, path: Path) -> None:
    for library, doors in DOORS.items():
        if any(within(i, library) for i in imports(path)):
            assert any(within(name, door) for door in doors), f"{library} belongs to {doors}"


def test_the_command_line_starts_without_the_heavy_libraries() -> None:
    code = "import sys, realizer, realizer.cli; print(*sys.modules)"
    loaded = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    ).stdout.split()
    heavy = {"scipy", "trimesh", "pyrender", "av", "clarabel", "websockets", "asyncio", "PIL", "pydantic"}
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
    heavy = {"scipy", "trimesh", "pyrender", "av", "PIL", "pydantic"}
    assert not heavy & {name.split(".")[0] for name in loaded}
