"""The answers to the Face tab: opens heads, makes faces of edited zones, scores and saves them."""

import errno
import hashlib
import json
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
from realizer_studio.editors.face.head_message import FACE_NAME, head_message, is_here, placed_points
from realizer_studio.editors.face.unit_fits import FILES as UNIT_FILES
from realizer_studio.editors.face.unit_fits import UnitFits
from realizer_studio.editors.packed_messages import packed, unpacked
from realizer_studio.faces.mpeg4.build import FILES, copy_with_zones
from realizer_studio.faces.mpeg4.faceeditor import fitted, read_faceeditor, write_faceeditor
from realizer_studio.faces.mpeg4.fap_scores import mean_score, score_faps
from realizer_studio.faces.mpeg4.parameters import FILE, read_setup, setup_from, setup_table, write_setup

FACES = "faces"  # in the folder of the setting `edit`
FOR_SETTING = "start the service with --edit DIR, or use realizer faces edit NAME"


class Studio:
    """The Face tab of one page: the head that it edits, in a folder of its own, and the faces made of it.

    Args:
        settings: of the service; faces are saved in the folder `faces` of its setting `edit`.
        may_save: whether this page may save faces.
    """

    def __init__(self, settings: Settings, may_save: bool) -> None:
        self._edit = settings.edit / FACES if may_save and settings.edit is not None else None
        self._place = TemporaryDirectory(prefix="realizer-face-")
        self._head: Path | None = None
        self._count = 0
        self._fits: dict[str, UnitFits] = {}

    def close(self) -> None:
        """Remove the folders."""
        self._place.cleanup()

    def answer(self, message: str | bytes) -> str | bytes:
        """Return the answer to a message: JSON with `id` and `type`, or packed with bytes behind it.

        Returns:
            JSON, or JSON packed with arrays; {"id", "error"} where something cannot be done.
        """
        number = None
        try:
            asked, payload = unpacked(message)
            number = asked.get("id")
            kinds = {
                "open": self._open, "import": self._import, "score": self._score, "pose": self._pose,
                "field": self._field, "xml": self._xml, "read": self._read, "glb": self._glb,
                "save": self._save, "unit": self._unit,
            }  # fmt: skip
            if asked.get("type") not in kinds:
                raise FaceError(
                    f"type: wanted one of {', '.join(kinds)}, got {str(asked.get('type'))[:80]!r}"
                )
            result = kinds[asked["type"]](asked, payload)
        except (RealizerError, FileNotFoundError) as error:
            return json.dumps({"id": number, "error": str(error), **getattr(error, "fields", {})})
        except OSError as error:
            return json.dumps({"id": number, "error": _os_text(error)})
        header, arrays = result if isinstance(result, tuple) else (result, {})
        return packed({"id": number, **header}, arrays) if arrays else json.dumps({"id": number, **header})

    def _open(self, asked: dict[str, Any], _: bytes) -> Any:
        name = str(asked.get("face", ""))
        if name not in (known := face_folders(self._edit)):
            raise FaceError(f"face: wanted one of {', '.join(known)}, got {name[:80]!r}")
        folder = self._new(name)
        for file in (*FILES, *UNIT_FILES):
            if (known[name] / file).is_file():
                shutil.copy(known[name] / file, folder / file)
        return self._opened(folder, (), _version(known[name]))

    def _import(self, asked: dict[str, Any], payload: bytes) -> Any:
        file = Path(str(asked.get("name", ""))).name
        name = FACE_NAME.sub("-", Path(file).stem.lower()).strip("-")[:64] or "face"
        source = self._new("file") / (file or "file")
        source.write_bytes(payload)
        try:
            words = import_bare(source, folder := self._new(name), name)
        except FaceError as error:
            raise FaceError(str(error).replace(f"{source.parent}/", "")) from None
        return self._opened(folder, words, "")

    def _opened(self, folder: Path, words: tuple[str, ...], version: str) -> Any:
        self._head, self._fits = folder, {}
        guesses = [word.removeprefix("guess ") for word in words if word.startswith("guess ")]
        notes = [word for word in words if not word.startswith("guess ")]
        header, arrays = head_message(folder)
        more = {"guesses": guesses, "notes": notes, "version": version, "editable": self._edit is not None}
        return header | more, arrays

    def _new(self, name: str) -> Path:
        self._count += 1
        folder = Path(self._place.name) / str(self._count) / name
        folder.mkdir(parents=True)
        return folder

    def _source(self) -> Path:
        if self._head is None:
            raise FaceError("there is no head yet: open a face or a mesh first")
        return self._head

    def _made(self, asked: dict[str, Any], folder: Path) -> Path:
        """Write the face that the page describes, and return its folder, whose name becomes the face's."""
        source = self._source()
        setup = setup_from("setup", _table(asked))
        work = self._new(folder.name)
        try:
            shutil.copytree(source, work, dirs_exist_ok=True)
            write_features(work / "features.csv", placed_points(work, setup.points))
            (work / FILE).unlink(missing_ok=True)
            parameters = work / "zones.toml"
            write_setup(parameters, setup)
            if setup.zones:
                copy_with_zones(work, folder, parameters, tuple(setup.zones) if asked.get("keep") else ())
            else:
                shutil.copytree(work, folder, ignore=shutil.ignore_patterns("zones.toml"))
        finally:
            shutil.rmtree(work.parent)
        return folder

    def _draft(self, asked: dict[str, Any]) -> Face:
        self._count += 1
        folder = self._made(asked, Path(self._place.name) / str(self._count) / self._source().name)
        try:
            return load_folder.__wrapped__(folder, "mpeg4")  # without its cache: each draft is another
        finally:
            shutil.rmtree(folder.parent)

    def _score(self, asked: dict[str, Any], _: bytes) -> Any:
        results = score_faps(self._draft(asked), tuple(asked.get("faps", ())))
        rows = [
            {"fap": r.fap, "sign": r.sign, "score": r.score, "weight": r.weight, "why": r.reasons}
            for r in results
        ]
        return {"scores": rows, "mean": mean_score(results)}

    def _pose(self, asked: dict[str, Any], _: bytes) -> Any:
        face = self._draft(asked) if "setup" in asked else load_folder(self._source(), "mpeg4")
        row = np.zeros((1, FAPS), np.float32)
        for fap, value in asked.get("values", {}).items():
            if not str(fap).isdecimal() or not 3 <= int(fap) <= FAPS or not isinstance(value, int | float):
                raise FaceError(f"values: wanted numbers by FAP, 3 to {FAPS}, got {str(fap)[:40]!r}")
            row[0, int(fap) - 1] = value
        return {}, {"vertices": deform(face, row)[0]}

    def _field(self, asked: dict[str, Any], _: bytes) -> Any:
        """Return what the face itself, before it was edited, moves by one unit of a FAP."""
        face, fap = load_folder(self._source(), "mpeg4"), asked.get("fap")
        if not isinstance(fap, int) or not 3 <= fap <= FAPS:
            raise FaceError(f"fap: wanted 3 to {FAPS}, got {str(fap)[:40]!r}")
        (first, last), out = face.basis["moving"], np.zeros(face.vertices.shape, np.float32)
        out[first:last] = face.basis["fields"][:, fap - 1].toarray().reshape(-1, 3)
        return {}, {"field": out}

    def _unit(self, asked: dict[str, Any], _: bytes) -> Any:
        """Return the markers, errors and field of an action unit, fitted to `markers` if there are any."""
        return self._units(asked).unit(asked.get("au"), asked.get("markers"))

    def _units(self, asked: dict[str, Any]) -> UnitFits:
        """Return the action units of the head with the feature points of the page, kept for these points."""
        folder, setup = self._source(), setup_from("setup", _table(asked))
        # A face with a model keeps the mouth of that.
        places = {} if (folder / UNIT_FILES[1]).is_file() else setup.points
        key = json.dumps({name: list(place) for name, place in places.items()})
        if key not in self._fits:
            found = placed_points(folder, places)
            face = replace(
                load_folder(folder, "mpeg4"),
                points={name: np.array(point.place, np.float32) for name, point in found.items()},
                feature_points={name: point.vertex for name, point in found.items()},
            )
            self._fits = {key: UnitFits(folder, face)}
        return self._fits[key]

    def _xml(self, asked: dict[str, Any], _: bytes) -> Any:
        with TemporaryDirectory() as place:
            lost = write_faceeditor(Path(place) / "zones.xml", setup_from("setup", _table(asked)))
            return {"text": (Path(place) / "zones.xml").read_text("utf-8"), "lost": lost}

    def _read(self, asked: dict[str, Any], payload: bytes) -> Any:
        """Return the parameters in a file, XML or TOML, in the coordinates of the head."""
        file = Path(str(asked.get("name", "zones.xml"))).name
        points = {name: p.place for name, p in read_features(self._source() / "features.csv").items()}
        with TemporaryDirectory() as place:
            path = Path(place) / file
            path.write_bytes(payload)
            try:
                setup = read_setup(path) if path.suffix == ".toml" else read_faceeditor(path)
                if path.suffix != ".toml" and not is_here(setup, points):
                    setup = fitted(setup, points)
            except FaceError as error:
                raise FaceError(str(error).replace(str(path), file)) from None
        n = len(read_arrays(self._source() / "mesh.npz", MESH)["vertices"])
        if far := [fap for fap, mask in setup.masks.items() if len(mask) and mask[-1] >= n]:
            raise FaceError(f"{file}: the mask of FAP {far[0]} is of another mesh: this one has {n} vertices")
        return {"setup": setup_table(setup)}

    def _glb(self, asked: dict[str, Any], _: bytes) -> Any:
        return {}, {"glb": np.frombuffer(face_glb(self._draft(asked)), np.uint8)}

    def _save(self, asked: dict[str, Any], _: bytes) -> Any:
        name = str(asked.get("name", ""))
        if self._edit is None:
            raise FaceError(f"nothing can be saved here: {FOR_SETTING}; the draft stays in this browser")
        if not NAME.fullmatch(name):
            raise FaceError(f"name: wanted a-z, 0-9, - and _, up to 64 of them, got {name[:80]!r}")
        target = self._edit / name
        self._edit.mkdir(parents=True, exist_ok=True)
        # Another process of the service may save as well.
        with (
            (self._edit / LOCK).open("a") as guard,
            TemporaryDirectory(prefix=".face-", dir=self._edit) as place,
        ):
            if not lock(guard):
                raise FaceError(f"{FACES}/{name}: another process saves just now: try again")
            if target.exists() and not (target / "face.toml").is_file():
                raise FaceError(
                    f"{FACES}/{name}: wanted a face folder, got something else; choose another name"
                )
            if (now := _version(target)) and now != asked.get("expected"):
                raise Conflict(
                    f"{FACES}/{name} is there already, or was saved by somebody else since you opened it", now
                )
            made = self._made(asked, Path(place) / name)
            self._units(asked).write(made, asked.get("units") or {})
            for deformer in DEFORMERS[: 2 if (made / UNIT_FILES[1]).is_file() else 1]:
                load_folder.__wrapped__(made, deformer)  # never save what cannot be loaded
            if target.exists():
                target.rename(Path(place) / "before")
            made.rename(target)
        load_folder.cache_clear()
        return {"saved": f"{FACES}/{name}", "version": _version(target)}


class Conflict(FaceError):
    """Somebody else has saved the face; `fields` has the version that is there now."""

    def __init__(self, text: str, version: str) -> None:
        super().__init__(f"{text}: save it under another name, or save again to replace it")
        self.fields = {"conflict": version}


def _table(asked: dict[str, Any]) -> dict[str, Any]:
    table = asked.get("setup")
    if not isinstance(table, dict):
        raise FaceError(f"setup: wanted a table of zones, got {str(table)[:80]!r}")
    return table


def _version(folder: Path) -> str:
    """Return a name of what a face folder contains, or "" if there is none."""
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
