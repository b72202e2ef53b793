"""The answers to the tab Face: opening heads, building faces from edited zones, scoring, saving."""

import errno
import hashlib
import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from realizer.core.atomic_files import lock
from realizer.core.errors import FaceError, RealizerError
from realizer.core.settings import Settings
from realizer.face.basis import FAPS
from realizer.face.deform import deform
from realizer.face.features import read_features, write_features
from realizer.face.load import DEFORMERS, MESH, face_folders, load_folder
from realizer.face.model import Face
from realizer.face.reading import read_arrays
from realizer.server.http.face_glb import face_glb
from realizer.server.runtime.edit_folder import LOCK, NAME
from realizer_studio.editors.face.bare_head import import_bare
from realizer_studio.editors.face.head_message import FACE_NAME, head_message, is_same_head, moved_points
from realizer_studio.editors.face.unit_fits import FILES as UNIT_FILES
from realizer_studio.editors.face.unit_fits import UnitFits
from realizer_studio.editors.packed_messages import packed, unpacked
from realizer_studio.faces.mpeg4.faceeditor import fitted, read_faceeditor, write_faceeditor
from realizer_studio.faces.mpeg4.fap_scores import mean_score, score_faps
from realizer_studio.faces.mpeg4.parameters import FILE, read_setup, setup_from, setup_table, write_setup
from realizer_studio.faces.mpeg4.zone_build import FILES, copy_with_zones

FACES = "faces"  # in the folder of the setting `edit`
FOR_SETTING = "start the service with --edit DIR, or use realizer faces edit NAME"


class Studio:
    """The tab Face of one page, with a temporary folder for the edited head and its faces.

    Args:
        settings: of the service; faces are saved in the folder `faces` of its setting `edit`.
        may_save: whether this page may save faces.
    """

    def __init__(self, settings: Settings, may_save: bool) -> None:
        self._edit = settings.edit / FACES if may_save and settings.edit is not None else None
        self._temporary = TemporaryDirectory(prefix="realizer-face-")
        self._head: Path | None = None
        self._count = 0
        self._fits: dict[str, UnitFits] = {}

    def close(self) -> None:
        """Remove the folders."""
        self._temporary.cleanup()

    def answer(self, message: str | bytes) -> str | bytes:
        """Return the answer to a message, which is JSON with `id` and `type`, or that packed with bytes.

        Returns:
            JSON, or JSON packed with arrays; {"id", "error"} for errors.
        """
        number = None
        try:
            request, payload = unpacked(message)
            number = request.get("id")
            handlers = {
                "open": self._open, "import": self._import, "score": self._score, "pose": self._pose,
                "field": self._field, "xml": self._xml, "read": self._read, "glb": self._glb,
                "save": self._save, "unit": self._unit,
            }  # fmt: skip
            if request.get("type") not in handlers:
                raise FaceError(
                    f"type: wanted one of {', '.join(handlers)}, got {str(request.get('type'))[:80]!r}"
                )
            result = handlers[request["type"]](request, payload)
        except (RealizerError, FileNotFoundError) as error:
            return json.dumps({"id": number, "error": str(error), **getattr(error, "fields", {})})
        except OSError as error:
            return json.dumps({"id": number, "error": _os_text(error)})
        header, arrays = result if isinstance(result, tuple) else (result, {})
        return packed({"id": number, **header}, arrays) if arrays else json.dumps({"id": number, **header})

    def _open(self, request: dict[str, Any], _: bytes) -> Any:
        name = str(request.get("face", ""))
        if name not in (folders := face_folders(self._edit)):
            raise FaceError(f"face: wanted one of {', '.join(folders)}, got {name[:80]!r}")
        folder = self._new(name)
        for file in (*FILES, *UNIT_FILES):
            if (folders[name] / file).is_file():
                shutil.copy(folders[name] / file, folder / file)
        return self._opened(folder, (), _version(folders[name]))

    def _import(self, request: dict[str, Any], payload: bytes) -> Any:
        file = Path(str(request.get("name", ""))).name
        name = FACE_NAME.sub("-", Path(file).stem.lower()).strip("-")[:64] or "face"
        source = self._new("file") / (file or "file")
        source.write_bytes(payload)
        try:
            notes = import_bare(source, folder := self._new(name), name)
        except FaceError as error:
            raise FaceError(str(error).replace(f"{source.parent}/", "")) from None
        return self._opened(folder, notes, "")

    def _opened(self, folder: Path, notes: tuple[str, ...], version: str) -> Any:
        self._head, self._fits = folder, {}
        guesses = [word.removeprefix("guess ") for word in notes if word.startswith("guess ")]
        sentences = [word for word in notes if not word.startswith("guess ")]
        header, arrays = head_message(folder)
        extra = {
            "guesses": guesses,
            "notes": sentences,
            "version": version,
            "editable": self._edit is not None,
        }
        return header | extra, arrays

    def _new(self, name: str) -> Path:
        self._count += 1
        folder = Path(self._temporary.name) / str(self._count) / name
        folder.mkdir(parents=True)
        return folder

    def _source(self) -> Path:
        if self._head is None:
            raise FaceError("there is no head yet: open a face or a mesh first")
        return self._head

    def _build(self, request: dict[str, Any], folder: Path) -> Path:
        """Build the face with the page's setup, and return its folder, whose name is the face's."""
        source = self._source()
        setup = setup_from("setup", _table(request))
        work = self._new(folder.name)
        try:
            shutil.copytree(source, work, dirs_exist_ok=True)
            write_features(work / "features.csv", moved_points(work, setup.points))
            (work / FILE).unlink(missing_ok=True)
            parameters = work / "zones.toml"
            write_setup(parameters, setup)
            if setup.zones:
                copy_with_zones(work, folder, parameters, tuple(setup.zones) if request.get("keep") else ())
            else:
                shutil.copytree(work, folder, ignore=shutil.ignore_patterns("zones.toml"))
        finally:
            shutil.rmtree(work.parent)
        return folder

    def _draft(self, request: dict[str, Any]) -> Face:
        self._count += 1
        folder = self._build(request, Path(self._temporary.name) / str(self._count) / self._source().name)
        try:
            return load_folder.__wrapped__(folder, "mpeg4")  # without the cache: drafts differ
        finally:
            shutil.rmtree(folder.parent)

    def _score(self, request: dict[str, Any], _: bytes) -> Any:
        results = score_faps(self._draft(request), tuple(request.get("faps", ())))
        rows = [
            {"fap": r.fap, "sign": r.sign, "score": r.score, "weight": r.weight, "why": r.reasons}
            for r in results
        ]
        return {"scores": rows, "mean": mean_score(results)}

    def _pose(self, request: dict[str, Any], _: bytes) -> Any:
        face = self._draft(request) if "setup" in request else load_folder(self._source(), "mpeg4")
        row = np.zeros((1, FAPS), np.float32)
        for fap, value in request.get("values", {}).items():
            if (
                not re.fullmatch("[0-9]{1,2}", fap)
                or not 3 <= int(fap) <= FAPS
                or not isinstance(value, int | float)
            ):
                raise FaceError(f"values: wanted numbers by FAP, 3 to {FAPS}, got {str(fap)[:40]!r}")
            row[0, int(fap) - 1] = value
        return {}, {"vertices": deform(face, row)[0]}

    def _field(self, request: dict[str, Any], _: bytes) -> Any:
        """Return the field of a FAP on the face before editing."""
        face, fap = load_folder(self._source(), "mpeg4"), request.get("fap")
        if not isinstance(fap, int) or not 3 <= fap <= FAPS:
            raise FaceError(f"fap: wanted 3 to {FAPS}, got {str(fap)[:40]!r}")
        (first, last), out = face.basis["moving"], np.zeros(face.vertices.shape, np.float32)
        out[first:last] = face.basis["fields"][:, fap - 1].toarray().reshape(-1, 3)
        return {}, {"field": out}

    def _unit(self, request: dict[str, Any], _: bytes) -> Any:
        """Return the markers, errors and field of an action unit, fitted to `markers` if given."""
        return self._units(request).unit(request.get("au"), request.get("markers"))

    def _units(self, request: dict[str, Any]) -> UnitFits:
        """Return the action units of the head with the page's feature points, cached for these points."""
        folder, setup = self._source(), setup_from("setup", _table(request))
        # A face with a model keeps the mouth of the model.
        points_of_page = {} if (folder / UNIT_FILES[1]).is_file() else setup.points
        key = json.dumps({name: list(position) for name, position in points_of_page.items()})
        if key not in self._fits:
            found = moved_points(folder, points_of_page)
            face = replace(
                load_folder(folder, "mpeg4"),
                points={name: np.array(point.place, np.float32) for name, point in found.items()},
                feature_points={name: point.vertex for name, point in found.items()},
            )
            self._fits = {key: UnitFits(folder, face)}
        return self._fits[key]

    def _xml(self, request: dict[str, Any], _: bytes) -> Any:
        with TemporaryDirectory() as temporary:
            losses = write_faceeditor(Path(temporary) / "zones.xml", setup_from("setup", _table(request)))
            return {"text": (Path(temporary) / "zones.xml").read_text("utf-8"), "lost": losses}

    def _read(self, request: dict[str, Any], payload: bytes) -> Any:
        """Return the parameters in a file, XML or TOML, in the coordinates of the head."""
        file = Path(str(request.get("name", "zones.xml"))).name
        points = {name: p.place for name, p in read_features(self._source() / "features.csv").items()}
        with TemporaryDirectory() as temporary:
            path = Path(temporary) / file
            path.write_bytes(payload)
            try:
                setup = read_setup(path) if path.suffix == ".toml" else read_faceeditor(path)
                if path.suffix != ".toml" and not is_same_head(setup, points):
                    setup = fitted(setup, points)
            except FaceError as error:
                raise FaceError(str(error).replace(str(path), file)) from None
        n = len(read_arrays(self._source() / "mesh.npz", MESH)["vertices"])
        if invalid := [fap for fap, mask in setup.masks.items() if len(mask) and mask[-1] >= n]:
            raise FaceError(
                f"{file}: the mask of FAP {invalid[0]} is of another mesh: this one has {n} vertices"
            )
        return {"setup": setup_table(setup)}

    def _glb(self, request: dict[str, Any], _: bytes) -> Any:
        return {}, {"glb": np.frombuffer(face_glb(self._draft(request)), np.uint8)}

    def _save(self, request: dict[str, Any], _: bytes) -> Any:
        name = str(request.get("name", ""))
        if self._edit is None:
            raise FaceError(f"nothing can be saved here: {FOR_SETTING}; the draft stays in this browser")
        if not NAME.fullmatch(name):
            raise FaceError(f"name: wanted a-z, 0-9, - and _, up to 64 of them, got {name[:80]!r}")
        target = self._edit / name
        self._edit.mkdir(parents=True, exist_ok=True)
        # Other processes of the service may save at the same time.
        with (
            (self._edit / LOCK).open("a") as guard,
            TemporaryDirectory(prefix=".face-", dir=self._edit) as temporary,
        ):
            if not lock(guard):
                raise FaceError(f"{FACES}/{name}: another process saves just now: try again")
            if target.exists() and not (target / "face.toml").is_file():
                raise FaceError(
                    f"{FACES}/{name}: wanted a face folder, got something else; choose another name"
                )
            if (now := _version(target)) and now != request.get("expected"):
                raise Conflict(
                    f"{FACES}/{name} is there already, or was saved by somebody else since you opened it", now
                )
            built = self._build(request, Path(temporary) / name)
            self._units(request).write(built, request.get("units") or {})
            for deformer in DEFORMERS[: 2 if (built / UNIT_FILES[1]).is_file() else 1]:
                load_folder.__wrapped__(built, deformer)  # raises FaceError for a face that cannot be loaded
            if target.exists():
                target.rename(Path(temporary) / "before")
            built.rename(target)
        load_folder.cache_clear()
        return {"saved": f"{FACES}/{name}", "version": _version(target)}


class Conflict(FaceError):
    """Somebody else has saved the face; `fields` has the stored version."""

    def __init__(self, text: str, version: str) -> None:
        super().__init__(f"{text}: save it under another name, or save again to replace it")
        self.fields = {"conflict": version}


def _table(request: dict[str, Any]) -> dict[str, Any]:
    table = request.get("setup")
    if not isinstance(table, dict):
        raise FaceError(f"setup: wanted a table of zones, got {str(table)[:80]!r}")
    return table


def _version(folder: Path) -> str:
    """Return a hash of the contents of a face folder, or "" if there is none."""
    digest = hashlib.sha256()
    for file in ("features.csv", FILE, "fields.npz", *UNIT_FILES):
        if (folder / file).is_file():
            digest.update((folder / file).read_bytes())
    return digest.hexdigest()[:16] if folder.is_dir() else ""


def _os_text(error: OSError) -> str:
    if error.errno in (errno.ENOSPC, errno.EDQUOT):
        return "the disk is full: nothing was changed there; make room and save again"
    if error.errno in (errno.EACCES, errno.EROFS, errno.EPERM):
        return (
            f"{error.filename}: the service may not write there: nothing was changed; choose another folder"
        )
    return str(error)
