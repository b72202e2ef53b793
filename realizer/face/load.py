"""The loader of face folders."""

from __future__ import annotations

import contextlib
import errno
import hashlib
import logging
import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from realizer.core.errors import FaceError, UnknownFaceError
from realizer.core.registry import Registry
from realizer.core.toml_text import parse_toml
from realizer.face.basis import basis_from
from realizer.face.cards import read_cards
from realizer.face.features import fapu_of, read_features
from realizer.face.maps import read_maps
from realizer.face.mesh_checks import range_faults, value_faults
from realizer.face.model import Face
from realizer.face.reading import face_errors, read_arrays
from realizer.tables import faps

if TYPE_CHECKING:
    from realizer.face.au.model import Model

PACKAGE = Path(__file__).parents[1]
CHECKOUT = PACKAGE.parent / "faces"
WHEEL = PACKAGE / "_faces"  # the copy in a wheel
FACES: Registry[Path | str] = Registry(
    "realizer.faces",
    {"checkout": "realizer.face.load:CHECKOUT", "wheel": "realizer.face.load:WHEEL"},
    wanted="a folder of face folders as a Path or a string",
    accepts=lambda value: isinstance(value, (Path, str)),
)
# What makes a face folder of a head, by the suffix of the head's file, such as ".glb". Heads are imported on
# first use.
BUILDERS: Registry[Callable[[Path, Path], object]] = Registry(
    "realizer.face_builders",
    {},
    wanted="a function that takes the file of a head and the folder to write",
    accepts=callable,
)
IMPORT = b"1"  # changed when heads come out of the import differently, so that they are imported again
DEFAULT = "ada"  # the face that the name "default" stands for
VARIABLE = "REALIZER_FACES"
DEFORMER = "REALIZER_DEFORMER"
DEFORMERS = ("mpeg4", "au")
MODEL = "au_extended.toml"
MESH = {"vertices": 2, "triangles": 2, "colours": 2, "occlusion": 1, "gloss": 1}  # array -> dimensions


log = logging.getLogger(__name__)


def face_name(name: str) -> str:
    """Return the folder name of a face name; "default" is a valid name. A path stays as it is."""
    return DEFAULT if name == "default" else name


def is_path(name: str | Path) -> bool:
    """Return whether a face is given as a path, of a face folder or of a GLB head, and not as a name."""
    if isinstance(name, Path) or Path(name).suffix.lower() in BUILDERS:
        return True
    return os.sep in name or (os.altsep or os.sep) in name


@dataclass(frozen=True, slots=True)
class FaceInfo:
    """A face folder: its name, path and the contents of face.toml."""

    name: str
    path: Path
    source: str
    licence: str
    description: str


def load_face(
    name: str | Path = "default", directory: Path | str | None = None, deformer: str | None = None
) -> Face:
    """Load a face.

    Args:
        name: its name, "default", or the path of a face folder or of a GLB head with ARKit's shapes.
            A head is imported once; the result is kept below $XDG_CACHE_HOME (~/.cache).
        directory: where to look first; else what REALIZER_FACES names, `faces` beside the package, the
            faces that came with the package, those of plug-ins, and `faces` in the current folder.
        deformer: "mpeg4" (only FAPs move it) or "au" (its model of action units; FAPs for the rest); None
            selects REALIZER_DEFORMER, then face.toml, then "mpeg4".

    Raises:
        FaceError: an unusable folder or head; the text says which file and what to change.
        PluginError: what imports heads is not installed.
        UnknownFaceError: no face of that name. FileNotFoundError: nothing at that path.
    """
    folder, chosen = folder_of(name, directory), _deformer_override(deformer)
    try:
        return load_folder(folder, chosen)
    except FaceError as error:
        raise FaceError(f"{error}; run realizer faces check {folder.name}") from None


def input_names(
    name: str | Path = "default", directory: Path | str | None = None, deformer: str | None = None
) -> tuple[str, ...]:
    """Return `Face.inputs` of a face without loading it. Arguments and errors as `load_face`."""
    return _model_inputs(_model(folder_of(name, directory), _deformer_override(deformer)))


def list_faces(directory: Path | str | None = None) -> tuple[FaceInfo, ...]:
    """Return all faces that `load_face` can find, by name, except those with an unreadable face.toml.

    Raises:
        FileNotFoundError: `directory` does not exist.
    """
    if directory is not None and not Path(directory).is_dir():
        raise FileNotFoundError(errno.ENOENT, "no such folder of faces", str(directory))
    found = []
    for name, folder in face_folders(directory).items():
        try:
            head = read_head(folder)
        except FaceError:
            continue  # one that is damaged hides no other; check_face says its faults
        found.append(FaceInfo(name, folder, head["source"], head["licence"], head.get("says", "")))
    return tuple(found)


def face_folders(directory: Path | str | None = None) -> dict[str, Path]:
    """Return every folder with a face.toml, by name, damaged or not; the first place with a name wins."""
    found: dict[str, Path] = {}
    for place in _places(directory):
        for folder in place.iterdir() if place.is_dir() else ():
            if (folder / "face.toml").is_file():
                found.setdefault(folder.name, folder)
    return dict(sorted(found.items()))


def folder_of(name: str | Path, directory: Path | str | None = None) -> Path:
    """Return the folder of a face, by name or path.

    Raises:
        UnknownFaceError: none of that name. FileNotFoundError: nothing at that path.
        FaceError: a head that cannot be imported.
    """
    if not isinstance(name, str | Path):
        raise TypeError(f"face: wanted the name or the path of a face, got {name!r}")
    if is_path(name):
        path = Path(name).resolve()
        if not path.exists():
            raise FileNotFoundError(errno.ENOENT, "no such face folder or GLB head", str(name))
        return path if path.is_dir() else _imported(path)
    name = face_name(str(name))
    for place in _places(directory):
        if name not in ("", "..") and (place / name).is_dir():
            return place / name
    known = ", ".join(face_folders(directory)) or "none"
    raise UnknownFaceError(
        f"face: wanted one of {known}, or the path of a face folder or a GLB, got {name!r}; "
        f"{VARIABLE} says where else faces lie"
    )


@lru_cache(maxsize=16)
def _imported(head: Path) -> Path:
    """Return the face folder of a GLB head, importing it if that was not done before."""
    suffix = head.suffix.lower()
    if suffix not in BUILDERS:
        known = f", or a head as {' or '.join(BUILDERS)}" if BUILDERS else ""
        raise FaceError(f"{head}: wanted a face folder{known}")
    build = BUILDERS[suffix]
    digest = hashlib.sha256(IMPORT + head.read_bytes()).hexdigest()[:16]
    cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    folder = cache / "realizer" / "faces" / digest / head.stem
    if not (folder / "face.toml").is_file():
        log.warning("%s: importing the head, once", head.name)
        folder.parent.mkdir(parents=True, exist_ok=True)
        with TemporaryDirectory(dir=folder.parent) as place:
            draft = Path(place) / head.stem
            build(head, draft)
            with contextlib.suppress(OSError):  # another process has imported it meanwhile
                draft.rename(folder)
    return folder


def read_head(folder: Path) -> dict[str, Any]:
    """Read and check face.toml.

    Raises:
        FaceError: no such file, not TOML, or a key is missing.
    """
    path = folder / "face.toml"
    with face_errors(path, "a TOML file with name, source, licence and parts"):
        head = parse_toml(path.read_text("utf-8"))
    for key in ("name", "source", "licence"):
        if not isinstance(head.get(key), str):
            raise FaceError(f'{path}: wanted {key} = "...", got {_head_text(head, key)}')
    for key, wanted in {"parts": "[parts]", "cameras": "tables [cameras.NAME]"}.items():
        if not isinstance(head.get(key, None if key == "parts" else {}), dict):
            raise FaceError(f"{path}: wanted {wanted}, got {_head_text(head, key)}")
    if not isinstance(head.get("says", ""), str):
        raise FaceError(f'{path}: wanted says = "...", got {_head_text(head, "says")}')
    return head


def _head_text(head: dict[str, Any], key: str) -> str:
    return repr(head[key]) if key in head else "none"


def _places(directory: Path | str | None) -> Iterator[Path]:
    if directory is not None:
        yield Path(directory)
    if os.environ.get(VARIABLE):
        yield Path(os.environ[VARIABLE])
    for _, folder in FACES.working():
        yield Path(folder)
    yield Path("faces")  # where `realizer faces import` writes


def _deformer_override(deformer: str | None) -> str | None:
    chosen = deformer or os.environ.get(DEFORMER) or None
    if chosen not in (None, *DEFORMERS):
        where = "deformer" if deformer else DEFORMER
        raise UnknownFaceError(f"{where}: wanted {' or '.join(DEFORMERS)}, got {chosen!r}")
    return chosen


@lru_cache(maxsize=16)
def _model(folder: Path, deformer: str | None) -> Model | None:
    """Return the model of a face with the units that are drawn, or None if FAPs alone move it."""
    path = folder / "face.toml"
    entry = read_head(folder).get("deformer", DEFORMERS[0])
    chosen = entry if isinstance(entry, dict) else {"name": entry}
    if chosen.get("name") not in DEFORMERS:
        raise FaceError(f"{path}: deformer: wanted {' or '.join(DEFORMERS)}, got {chosen.get('name')!r}")
    if (deformer or chosen["name"]) == "mpeg4":
        return None
    file = chosen.get("model", MODEL)
    if not isinstance(file, str) or Path(file).name != file:
        raise FaceError(f"{path}: deformer.model: wanted the name of a file beside it, got {file!r}")
    if not (folder / file).is_file():
        raise FaceError(
            f"{folder / file}: the deformer au draws by this model, which is not there; "
            f"make it by `realizer faces fit {folder.name}`"
        )
    from realizer.face.au.file import read_model

    model = read_model(folder / file)
    drawn = chosen.get("aus", list(model.units))
    if not isinstance(drawn, list) or not set(drawn) <= set(model.units):
        known = ", ".join(map(str, sorted(model.units)))
        raise FaceError(f"{path}: deformer.aus: wanted a list of units of {file} ({known}), got {drawn!r}")
    return replace(model, units={au: unit for au, unit in model.units.items() if au in drawn})


def _model_inputs(model: Model | None) -> tuple[str, ...]:
    names = tuple(row.name for row in faps())
    if model is None:
        return names
    from realizer.face.au.deformer import columns

    return names + columns(model)


@lru_cache(maxsize=16)
def load_folder(folder: Path, deformer: str | None) -> Face:
    """Load the face in that folder. Errors as `load_face`, without its advice."""
    head = read_head(folder)
    model = _model(folder, deformer)
    mesh = read_arrays(folder / "mesh.npz", MESH)
    if values := value_faults(mesh):
        raise FaceError(f"{folder / 'mesh.npz'}: {values[0]}")
    if bad := range_faults(head["parts"], len(mesh["vertices"])):
        raise FaceError(f"{folder / 'face.toml'}: {bad[0]}")
    points = read_features(folder / "features.csv")
    vertices = np.ascontiguousarray(mesh["vertices"], np.float32)
    feature_points = {name: point.vertex for name, point in points.items()}
    places = {name: np.array(point.place, np.float32) for name, point in points.items()}
    fapu = fapu_of(places, folder / "features.csv")
    parts = {name: (int(a), int(b)) for name, (a, b) in head["parts"].items()}
    return Face(
        name=head["name"],
        source=head["source"],
        licence=head["licence"],
        vertices=vertices,
        triangles=np.ascontiguousarray(mesh["triangles"], np.int32),
        colours=np.ascontiguousarray(mesh["colours"], np.uint8),
        occlusion=np.asarray(mesh["occlusion"], np.float32) / np.float32(255),
        gloss=np.asarray(mesh["gloss"], np.float32) / np.float32(255),
        parts=parts,
        feature_points=feature_points,
        points=places,
        fapu=fapu,
        basis=basis_from(folder / "fields.npz", vertices, places, parts, fapu),
        cameras=head.get("cameras", {}),
        inputs=_model_inputs(model),
        model=model,
        maps=read_maps(folder, head, mesh),
        cards=read_cards(folder, head, len(vertices)),
    )
