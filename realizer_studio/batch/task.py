"""Tasks of a batch: documents with the keys of their outputs. Equal keys mean equal outputs."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass, fields
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import bml_schema
import realizer
from realizer.core.options import PlayOptions

# Folders of our packages that do not affect outputs.
EXCLUDED = {"static", "web", "_faces", "server", "cli", "batch"}
# Other packages that affect outputs: voices and encoders.
ENGINES = ("av", "espeakng-loader", "hibari-tts", "numpy", "pillow")


@dataclass(frozen=True, kw_only=True)
class Options(PlayOptions):
    """The options of all documents of a batch; see `RenderSettings`. `formats` are suffixes of files."""

    formats: tuple[str, ...]
    voice: str
    size: tuple[int, int] = (512, 512)
    camera: str = "front"
    light: str | None = None
    background: str | None = None

    @property
    def files(self) -> dict[str, Path]:
        """Option -> its file or folder; keys depend on their content, not on their path."""
        paths = {"media": self.media, "expressions": self.expressions, "mapping": self.mapping}
        if self.cooccurrence not in ("on", "off"):
            paths["cooccurrence"] = Path(self.cooccurrence)
        return {option: path for option, path in paths.items() if path is not None}

    def to_json(self) -> str:
        """Return all options but the files as JSON."""
        values = {f.name: getattr(self, f.name) for f in fields(self) if f.name not in self.files}
        return json.dumps(values, sort_keys=True)


@dataclass(frozen=True, slots=True)
class Task:
    """A document to play.

    Attributes:
        name: name of the document.
        key: key of its outputs.
        text: the document.
        fingerprint: result of `fingerprint` in the process that made the task.
    """

    name: str
    key: str
    text: bytes
    fingerprint: str


def fingerprint(options: Options) -> str:
    """Return a digest of everything except the document that affects outputs, 64 hexadecimal digits.

    It covers the options and their files, the program with its tables, the face, and the versions of engines.

    Raises:
        FaceError: there is no such face.
        OSError: a file cannot be read.
    """
    from realizer.face.load import folder_of

    digest = hashlib.sha256(options.to_json().encode())
    for package in (bml_schema, realizer):
        root = Path(package.__path__[0])
        for suffix in (".py", ".csv", ".toml"):
            files = (p for p in root.rglob(f"*{suffix}") if not EXCLUDED & {*p.relative_to(root).parts})
            _add(digest, root, files)
    for folder in (folder_of(options.face), *options.files.values()):
        _add(digest, folder, iter([folder]) if folder.is_file() else filter(Path.is_file, folder.rglob("*")))
    for name in ENGINES:
        try:
            digest.update(f"{name} {version(name)}\n".encode())
        except PackageNotFoundError:
            digest.update(f"{name} none\n".encode())
    return digest.hexdigest()


def key_of(text: bytes, fingerprint: str) -> str:
    """Return the key of a document's outputs, 64 hexadecimal digits."""
    return hashlib.sha256(fingerprint.encode() + b"\n" + text).hexdigest()


def _add(digest: hashlib._Hash, root: Path, files: Iterator[Path]) -> None:
    for path in sorted(files):
        content = path.read_bytes()
        digest.update(f"{path.relative_to(root).as_posix()} {len(content)}\n".encode())
        digest.update(content)
