"""Files of every kind that a command reads, and how they are broken: sources, mutations, the reading."""

from __future__ import annotations

import json
import re
import resource
import shutil
import struct
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from copy import deepcopy
from dataclasses import dataclass
from functools import cache
from io import BytesIO, StringIO
from pathlib import Path
from random import Random
from tempfile import TemporaryDirectory
from typing import Any
from zipfile import ZipFile

import click
import numpy as np

from realizer.cli import cli
from realizer.core.errors import RealizerError
from realizer.core.settings import Settings
from realizer.expressions.library import library_of
from realizer.face.load import folder_of, load_face
from realizer.tables.mappings import write_mapping
from realizer_studio.faces.mpeg4.defaults import default_setup
from realizer_studio.faces.mpeg4.faceeditor import read_faceeditor, write_faceeditor
from realizer_studio.faces.mpeg4.parameters import read_setup, write_setup
from realizer_studio.faces.person.recipe import appearance_of, read_recipe
from tests.mutants import mutants
from tests.realizer_studio.faces.arkit.conftest import face_glb

__all__ = ["FILES", "bounded_memory", "file_tried"]

TESTS = Path(__file__).parent
ROOM = 3 * 2**30  # bytes that a try may reserve
# What stands in the place of a value.
VALUES: Sequence[Any] = (
    *(None, True, False, 0, 1, -1, 3, 2**31, 2**63, 10**400, 0.5, -1e308, float("nan"), float("inf")),
    *("", "x", "\0", "x" * 300, "../../etc/passwd", "data:,", [], {}, [[]], [0] * 4, [1e400] * 16, {"a": {}}),
)
HUGE = b"'shape': (2147483647, 9), }"  # in the header of an array
# Values of TOML.
LITERALS = (
    *("true", "0", "-1", "2.5", "nan", "inf", "-inf", "1e400", f"{2**63}", "9" * 400, "9" * 5000),
    *("0x" + "f" * 5000, "1979-05-27", "07:32:00", "''", '"x"', '"\\u0000"', '"../x"', "[]", "[[1, 2], [3]]"),
    *('["a", 1]', "{}", "{ a = { b = 1 } }", "[" * 3000 + "]" * 3000, "[" * 3000, f"[{'0, ' * 20000}]"),
)


@dataclass(frozen=True)
class FileKind:
    """A kind of file.

    Attributes:
        name: of the file that is read.
        sources: sound files.
        read: reads the file at a path; returns the message that refuses it, or "".
        broken: returns a broken one for sources and a seed; None: by the mutations of texts.
    """

    name: str
    sources: Callable[[], tuple[bytes, ...]]
    read: Callable[[Path], str]
    broken: Callable[[tuple[bytes, ...], int], bytes] | None = None


def file_tried(kind: FileKind, seed: int) -> str:
    """Read a broken file of a kind, and return the message that refuses it, or "".

    Raises:
        AssertionError: the message does not name the file, or the face that it is in.
        Exception: an error of no class of ours, or MemoryError.
    """
    sources = kind.sources()
    content = next(mutants(sources, 1, seed)) if kind.broken is None else kind.broken(sources, seed)
    with TemporaryDirectory() as folder, bounded_memory():
        path = Path(folder) / kind.name
        path.write_bytes(content)
        message = kind.read(path)
        assert not message or path.name in message or "eve" in message, message
        return message


@contextmanager
def bounded_memory() -> Iterator[None]:
    """Let allocations fail that need far more memory than any file."""
    limits = resource.getrlimit(resource.RLIMIT_AS)
    used = int(Path("/proc/self/statm").read_text("ascii").split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + ROOM, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, limits)


def command(*words: str) -> str:
    """Run a command; return its error, or the faults that it finds, or "" after a success."""
    told, faults = StringIO(), StringIO()
    try:
        with redirect_stdout(told), redirect_stderr(faults):
            status = cli([*words, "--quiet"], standalone_mode=False)
    except click.ClickException as error:
        return error.format_message()
    except RealizerError as error:
        return str(error)
    return told.getvalue() + faults.getvalue() if status else ""


def reading(read: Callable[[Path], object]) -> Callable[[Path], str]:
    """Return a reading that returns the message of our own errors."""

    def read_or_message(path: Path) -> str:
        try:
            read(path)
        except RealizerError as error:
            return str(error)
        return ""

    return read_or_message


# sources ------------------------------------------------------------------------------------------


@cache
def heads() -> tuple[bytes, ...]:
    """Return GLB heads: with few shapes, with sparse ones, and with a texture and a skeleton."""
    face, only = load_face("ida"), ("jawOpen", "eyeBlinkLeft", "eyeBlinkRight", "mouthSmileLeft")
    return (
        face_glb(face, only=only),
        face_glb(face, only=only[:2], sparse=True),
        _dressed(face_glb(face, only=())),
    )


def _dressed(glb: bytes) -> bytes:
    """Return a GLB whose first mesh has a texture, a skeleton and a node with a matrix."""
    document, data = _split(glb)
    attributes = document["meshes"][0]["primitives"][0]["attributes"]
    count = document["accessors"][attributes["POSITION"]]["count"]
    zeros = {"componentType": 5126, "count": count}
    document["accessors"] += [
        zeros | {"type": "VEC2"},
        zeros | {"type": "VEC4"},
        {"componentType": 5123, "count": count, "type": "VEC4"},
        {"componentType": 5126, "count": 1, "type": "MAT4"},
    ]
    last = len(document["accessors"])
    attributes |= {"TEXCOORD_0": last - 4, "WEIGHTS_0": last - 3, "JOINTS_0": last - 2}
    pixel = "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
    document["images"] = [{"uri": f"data:image/png;base64,{pixel}"}]
    document["textures"] = [{"source": 0}]
    document["materials"][0]["pbrMetallicRoughness"]["baseColorTexture"] = {
        "index": 0,
        "extensions": {"KHR_texture_transform": {"scale": [2, 2], "offset": [0.5, 0], "rotation": 0.1}},
    }
    document["skins"] = [{"joints": [0], "inverseBindMatrices": last - 1}]
    document["nodes"][0] |= {"skin": 0, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}
    document["nodes"][1] |= {"rotation": [0, 0, 0, 1], "scale": [1, 1, 1], "translation": [0, 0, 0]}
    return _joined(document, data)


def broken_head(sources: tuple[bytes, ...], seed: int) -> bytes:
    """Return a GLB with broken bytes, values or arrays."""
    random = Random(seed)
    if random.random() < 0.2:
        return next(mutants(sources, 1, seed))
    document, data = _split(random.choice(sources))
    arrays = [(view["byteOffset"], view["byteLength"]) for view in document["bufferViews"]]
    for _ in range(random.choice((1, 1, 2, 4))):
        if random.random() < 0.25:
            start, size = random.choice(arrays)
            word = random.choice((b"\0\0\0\0", b"\xff\xff\xff\xff", b"\0\0\xc0\x7f", random.randbytes(4)))
            data = data[:start] + (word * (size // 4 + 1))[:size] + data[start + size :]
        else:
            change(document, random)
    return _joined(document, data)


def broken_toml(sources: tuple[bytes, ...], seed: int) -> bytes:
    """Return a TOML file with a value of another kind, or broken as a text."""
    random = Random(seed)
    if random.random() < 0.5:
        return next(mutants(sources, 1, seed))
    content = random.choice(sources)
    old = random.choice(list(re.finditer(rb"(?<== )[^\n,}]+", content)))
    return content[: old.start()] + random.choice(LITERALS).encode() + content[old.end() :]


def broken_arrays(sources: tuple[bytes, ...], seed: int) -> bytes:
    """Return an .npz file with broken bytes, or with an array of other values, of another type or shape."""
    random = Random(seed)
    if random.random() < 0.2:
        return next(mutants(sources, 1, seed))
    with np.load(BytesIO(random.choice(sources))) as file:
        arrays = {name: file[name] for name in file.files}
    name = random.choice(list(arrays))
    array = arrays[name]
    changed: Sequence[Callable[[], np.ndarray]] = (
        lambda: np.full_like(array, random.choice((0, 1, 2**31 - 1 if array.dtype.itemsize > 2 else 255))),
        lambda: np.full(array.shape, random.choice((np.nan, np.inf, -1.0, 1e300))),
        lambda: array[: random.randrange(len(array) + 1)] if array.ndim else array[None],
        lambda: array.reshape(-1),
        lambda: array.astype(random.choice(("f8", "i8", "u1", "c16", "U4", "?"))),
        lambda: np.where(np.arange(array.size).reshape(array.shape) == array.size // 2, -5, array),
    )
    arrays[name] = random.choice(changed)()
    out = BytesIO()
    with ZipFile(out, "w") as archive:
        for key, value in arrays.items():
            content = BytesIO()
            np.lib.format.write_array(content, np.asarray(value))
            raw = content.getvalue()
            if key == name and random.random() < 0.3:
                raw = re.sub(rb"'shape': \([^)]*\), } *", lambda old: HUGE.ljust(len(old[0])), raw, count=1)
            archive.writestr(f"{key}.npy", raw)
    return out.getvalue()


def change(value: Any, random: Random) -> None:
    """Change a random place of a value of JSON, at any depth: replace, repeat or delete it."""
    while isinstance(value, dict | list) and value:
        key = random.choice(list(value)) if isinstance(value, dict) else random.randrange(len(value))
        inner = value[key]
        if not isinstance(inner, dict | list) or not inner or random.random() < 0.1:
            if isinstance(inner, int) and random.random() < 0.3:
                value[key] = inner + random.choice((-1, 1, 2**31, -(2**31)))
            elif random.random() < 0.1:
                del value[key]
            else:
                value[key] = deepcopy(random.choice(VALUES))
            return
        if isinstance(value, list) and random.random() < 0.05:
            value.append(deepcopy(inner))
        value = inner


def _split(glb: bytes) -> tuple[dict[str, Any], bytes]:
    size = struct.unpack_from("<I", glb, 12)[0]
    return json.loads(glb[20 : 20 + size]), glb[28 + size :]


def _joined(document: dict[str, Any], data: bytes) -> bytes:
    text = json.dumps(document).encode()
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
    chunks += struct.pack("<II", len(data), 0x004E4942) + data
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def clips() -> tuple[bytes, ...]:
    """Return FAP clips in the three formats."""
    from tests.fuzz import fap_files

    found = list(fap_files())
    with TemporaryDirectory() as folder:
        for suffix in ("fap", "csv", "json"):
            source, out = Path(folder) / "source.fap", Path(folder) / f"out.{suffix}"
            source.write_bytes(found[-1])
            assert not command("fap", "convert", str(source), "-o", str(out))
            found.append(out.read_bytes())
    return tuple(found)


def own_files(*names: str) -> Callable[[], tuple[bytes, ...]]:
    """Return a function that returns files of the face ada by name."""
    return lambda: tuple((folder_of("ada") / name).read_bytes() for name in names)


SETTINGS = b"""fps = 30
port = 0
host = "127.0.0.1"
origins = ["https://a.example", "*"]
asap_ports = [7500, 7501]
token = "a-token"
idle = false
max_rate = 5.5
cooccurrence = "on"
"""
EXPRESSION = b"""name = "polite smile"
means = ["greeting", "thank you"]
features = "raised corners of the mouth"
aus = { 12 = 0.5, 6 = 0.2, 2L = 0.4 }
onset = 0.3
apex = 0.8
offset = 0.5
possible = [0.3, 4.0]
probable = [0.5, 2.0]
source = "seen at the front desk"
"""
TIMELINE = b"""mixer = "successive"
order = [4, 1, 2]
[[channel]]
name = "brows"
joins = "both"
curve = "linear"
start = 0.0
entries = [
    { expression = "template:surprise", intensity = 0.8, duration = 1.2 },
    { expression = "neutral", duration = 0.5 },
]
"""
SCENE = (b"cup 0.1 -0.2 0.5\ndoor 1 0 2\n", b'{"cup": [0.1, -0.2, 0.5], "door": {"x": 1, "y": 0, "z": 2}}')


@cache
def documents() -> tuple[bytes, ...]:
    return tuple(path.read_bytes() for path in sorted((TESTS / "corpus").rglob("*.xml")))


@cache
def mappings() -> tuple[bytes, ...]:
    from realizer.face.fap_mapping import mapping_of

    with TemporaryDirectory() as folder:
        path = Path(folder) / "m.txt"
        write_mapping(path, mapping_of("ada").rows[:40], "a test")
        return (path.read_bytes(),)


@cache
def zones() -> tuple[bytes, ...]:
    """Return the zones of a face in our TOML."""
    return (_written(write_setup),)


@cache
def faceeditor_files() -> tuple[bytes, ...]:
    return (_written(write_faceeditor),)


def _written(write: Callable[[Path, Any], object]) -> bytes:
    face = load_face("ida")
    setup = default_setup(face.vertices.astype(float), face.triangles, face.points, face.parts["skin"])
    with TemporaryDirectory() as folder:
        write(Path(folder) / "zones", setup)
        return (Path(folder) / "zones").read_bytes()


@cache
def points() -> tuple[bytes, ...]:
    """Return tracked points of two frames."""
    lines = ["# source: tests", "# units: metres", "# licence: CC0", "frame,point,x,y,z"]
    for frame in (0, 1):
        lines += [
            f"{frame},{name},{x:.5f},{y:.5f},{z:.5f}" for name, (x, y, z) in load_face("ida").points.items()
        ]
    return ("\n".join(lines).encode(),)


@cache
def profiles() -> tuple[bytes, ...]:
    with TemporaryDirectory() as folder:
        path = Path(folder) / "joy.txt"
        assert not command("emotion", "joy", "-o", str(path))
        return (path.read_bytes(),)


# reading ------------------------------------------------------------------------------------------


def in_face(path: Path) -> str:
    """Check a face in which one file is replaced by another, and load it if that finds nothing."""
    eve = path.parent / "eve"
    shutil.copytree(folder_of("ada"), eve)
    shutil.copy(path, eve / path.name)
    faults = command("faces", "check", str(eve))
    if not faults:
        load_face("eve", path.parent, "au")
    return faults


def in_recipe(path: Path) -> None:
    """Read a recipe where there are the shape targets of the sound one."""
    for name in tomllib.loads(own_files("recipe.toml")()[0].decode())["targets"]:
        for side in "lr":
            target = path.parent / f"mpfb2/targets/{name.replace('/*', f'/{side}-')}.target"
            target.parent.mkdir(parents=True, exist_ok=True)
            target.touch()
    appearance_of(read_recipe(path, path.parent).look)


def drawn(path: Path) -> str:
    """Draw the timeline of a document as SVG and PNG; a refused document is no error of the plot."""
    for suffix in (".svg", ".png"):
        out = path.with_suffix(suffix)
        command("schedule", str(path), "--voice", "silent", "--plot", str(out))
    return ""


def converted(path: Path) -> str:
    return command("fap", "info", str(path), "--json") or command(
        "fap", "convert", str(path), "--expand", "--fps", "30", "-o", str(path.with_suffix(".out.fap"))
    )


def row(*words: str) -> Callable[[Path], str]:
    """Return a reading by a command, in whose words FILE and OUT stand for paths."""

    def read(path: Path) -> str:
        places = {"FILE": path, "OUT": path.parent / "out.fap"}
        return command(*(word if word not in places else str(places[word]) for word in words))

    return read


FILES: Mapping[str, FileKind] = {
    "heads": FileKind("head.glb", heads, row("faces", "check", "FILE"), broken_head),
    "clips": FileKind("clip.fap", clips, converted),
    "settings": FileKind(
        "service.toml",
        lambda: (SETTINGS,),
        reading(lambda path: Settings.read(file=path, environment={})),
        broken_toml,
    ),
    "expressions": FileKind(
        "smile.toml", lambda: (EXPRESSION,), reading(lambda path: library_of(path.parent)), broken_toml
    ),
    "timelines": FileKind("brows.toml", lambda: (TIMELINE,), row("check", "FILE"), broken_toml),
    "profiles": FileKind("joy.txt", profiles, row("emotion", "FILE")),
    "mappings": FileKind("mapping.txt", mappings, row("faces", "mapping", "ida", "--mapping", "FILE")),
    "scenes": FileKind(
        "scene.txt", lambda: SCENE, row("schedule", str(TESTS / "corpus/core/gaze.xml"), "--scene", "FILE")
    ),
    "zones": FileKind("zones.toml", zones, reading(read_setup), broken_toml),
    "faceeditor": FileKind("zones.xml", faceeditor_files, reading(read_faceeditor)),
    "recipes": FileKind("recipe.toml", own_files("recipe.toml"), reading(in_recipe), broken_toml),
    "points": FileKind("points.csv", points, row("track", "FILE", "-o", "OUT")),
    "faces": FileKind("face.toml", own_files("face.toml"), in_face, broken_toml),
    "models": FileKind("au_extended.toml", own_files("au_extended.toml"), in_face, broken_toml),
    "features": FileKind("features.csv", own_files("features.csv"), in_face),
    "meshes": FileKind("mesh.npz", own_files("mesh.npz"), in_face, broken_arrays),
    "fields": FileKind("fields.npz", own_files("fields.npz"), in_face, broken_arrays),
    "plots": FileKind("document.xml", documents, drawn),
}
