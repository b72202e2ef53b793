"""The plan of a study, and a writer of its folder, which a browser opens, and of its key beside it."""

import hashlib
import json
import os
import secrets
import shutil
import tempfile
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from realizer.core.atomic_files import write_text
from realizer.face.load import list_faces
from realizer_studio.study.drawing import Drawer, Variant
from realizer_studio.study.items import ANSWERS, KINDS, WHEEL, Item, checks, displacements, films, naming
from realizer_studio.study.matching import TRIPLES, Reference, matching, references

MATCHING = ("visual", "emotional")
# Approximate numbers of pictures or films for each variant.
DRAWN = {"visual": 300, "emotional": 300, "naming": 36, "displacements": 129, "films": 16}


@dataclass(frozen=True)
class Plan:
    """The plan of a study."""

    kinds: Sequence[str]  # of `KINDS`
    variants: Sequence[Variant]  # the variants of faces to compare
    source: str | None = None  # the references: a folder of photographs, a face, or None for another face
    language: str = "en"  # of films
    most: int | None = None  # largest number of questions of each kind, or None
    seed: int = 0  # of all random choices

    @property
    def drawn(self) -> int:
        """The approximate number of pictures."""
        return sum({DRAWN[kind] for kind in self.kinds}) * len(self.variants)

    def items(self, step: Callable[[int], object] = lambda count: None) -> list[Item]:
        """Return all questions, with attention items; raises errors of `references`, `matching` and `films`.

        `step` is called with 1 after each picture or film.
        """
        draws = np.random.default_rng(self.seed)
        found: list[Item] = []
        with Drawer(step) as draw:
            if matched := [kind for kind in MATCHING if kind in self.kinds]:
                compared = self._references(draw, draws)
                for variant in self.variants:
                    found += matching(matched, variant, compared, draw, draws)
            if "naming" in self.kinds:
                found += naming(self.variants, draw)
            if "displacements" in self.kinds:
                found += displacements(self.variants, draw)
        if "films" in self.kinds:
            film_texts = texts()[self.language]["films"][: self.most]
            found += films(self.variants, film_texts, self.language, draws, step)
        chosen: list[Item] = []
        for kind in [kind for kind in KINDS if kind in self.kinds]:
            of_kind = [item for item in found if item.kind == kind]
            if self.most is not None and len(of_kind) > self.most:
                of_kind = [of_kind[k] for k in draws.choice(len(of_kind), self.most, replace=False)]
            chosen += [*of_kind, *checks(of_kind, draws)]
        return chosen

    def _references(self, draw: Drawer, draws: np.random.Generator) -> list[Reference]:
        """Return the references, limited to the number that is needed."""
        used = [one.face for one in self.variants]
        unused = (info.name for info in list_faces() if info.name not in used)
        source = self.source or next(unused, used[0])
        available = references(source, draw)
        if self.most is None:
            return available
        return [available[k] for k in draws.permutation(len(available))[: -(-self.most // TRIPLES)]]


ITEMS, TEXTS, PAGE = "items.js", "texts.js", "index.html"
SAVED = 1_000_000_000  # modification time of all files, in seconds, which hides their order


def key_of(folder: Path) -> Path:
    """Return the path of the key, which is beside a study's folder."""
    folder = folder.resolve()
    return folder.with_name(f"{folder.name}.key.json")


def texts() -> dict[str, Any]:
    """Return the page's texts by language."""
    content = files(__package__).joinpath("texts.json").read_text("utf-8")
    return dict(json.loads(content))


def check_folder(folder: Path) -> None:
    """Raise ValueError if a study cannot be written to a folder without replacing files."""
    parent = folder.resolve().parent
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise ValueError(f"{folder}: wanted a new or empty folder, got one with files in it")
    if key_of(folder).exists():
        raise ValueError(f"{key_of(folder)}: is the key of an earlier study; move it, or name another DIR")
    if not (parent.is_dir() and os.access(parent, os.W_OK)):
        raise ValueError(f"{parent}: wanted a folder that can be written, to make {folder.name} in it")


def write_kit(folder: Path, items: Sequence[Item], about: Mapping[str, Any]) -> Path:
    """Write the folder of a study and its key, and return the key's path; an error leaves no files.

    Names of files and items are hashes with a random salt, and items are ordered by name, so that the folder
    does not reveal answers.

    Args:
        about: `judges`, `language`, and further facts for the key.

    Raises:
        ValueError: as `check_folder`.
        OSError: it cannot be written.
    """
    check_folder(folder)
    salt = secrets.token_hex(16)
    study = {"study": _name(salt, "study"), "judges": about["judges"], "language": about["language"]}
    with _new_folder(folder) as draft:
        public, truths = [], {}
        for number, item in enumerate(items):
            name = _name(salt, str(number))
            pictures = {role: _save(draft, salt, content) for role, content in item.shown.items()}
            options = {
                _save(draft, f"{salt}{number}", content): role for role, content in item.options.items()
            }
            entry = {"id": name, "kind": item.kind, "shown": pictures, "options": sorted(options)}
            public.append(entry | {"text": dict(item.text)} | ({"check": item.check} if item.check else {}))
            truths[name] = {"kind": item.kind, **item.truth, "shown": pictures, "options": options}
        kinds = [kind for kind in KINDS if any(item.kind == kind for item in items)]
        content = study | {"kinds": kinds, "answers": ANSWERS, "wheel": WHEEL}
        content |= {"items": sorted(public, key=lambda entry: str(entry["id"]))}
        _script(draft / ITEMS, "STUDY", content)
        _script(draft / TEXTS, "TEXTS", texts())
        page, script = (files(__package__).joinpath(name).read_text("utf-8") for name in (PAGE, "page.js"))
        (draft / PAGE).write_text(page.replace("/* page.js */", script), "utf-8")
        for path in [*draft.iterdir(), draft]:
            os.utime(path, (SAVED, SAVED))
        key = {**study, **about, "folder": folder.name, "salt": salt, "items": truths}
        write_text(key_of(folder), json.dumps(key, indent=1) + "\n")
    return key_of(folder)


def _name(salt: str, what: str) -> str:
    return hashlib.sha256(f"{salt} {what}".encode()).hexdigest()[:12]


def _save(folder: Path, salt: str, content: bytes) -> str:
    suffix = ".webp" if content[8:12] == b"WEBP" else ".webm"
    name = _name(salt, hashlib.sha256(content).hexdigest()) + suffix
    (folder / name).write_bytes(content)
    return name


def _script(path: Path, name: str, content: Any) -> None:
    """Write JSON as a script, because a page that is opened as a file cannot fetch other files."""
    text = json.dumps(content, ensure_ascii=False, indent=1)
    path.write_text(f"window.{name} = {text};\n", "utf-8")


@contextmanager
def _new_folder(folder: Path) -> Iterator[Path]:
    """Yield a temporary folder, which is renamed at the end; on errors it and the key are deleted."""
    draft = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.resolve().parent))
    try:
        yield draft
        draft.chmod(0o755)
        if folder.exists():
            folder.rmdir()
        draft.replace(folder)
    except BaseException:
        key_of(folder).unlink(missing_ok=True)
        shutil.rmtree(draft, ignore_errors=True)
        raise
