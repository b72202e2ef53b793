"""Sources of documents: BML, a text to speak, a file, or several of these."""

import errno
import os
import re
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from bml_schema import CORE, Block, BMLError, Speech, read, write
from bml_schema.behaviours import SpeechText
from bml_schema.element_reader import Vocabulary
from bml_schema.nodes import BMLT
from realizer.core.sound_formats import SUFFIXES as SOUNDS
from realizer.core.sound_formats import format_of

Source = str | bytes | Path
# Suffixes of documents. A text in a .txt file is spoken; those of timelines are read by `check`.
SUFFIXES = (".txt", ".bml", ".xml", ".toml", ".json")
LONGEST_PATH = 1024  # characters
LONGEST = 10_000  # characters of one speech, as in `_PIECE`
# A part of a long text: up to the last end of a sentence in it, or else the last blank, or else cut.
_PIECE = re.compile(
    r"\S(?:.{0,9998}(?:[.!?…](?=\s|\Z)|[。！？])|.{0,9999}(?=\s|\Z)|.{0,9999})",
    re.DOTALL,
)
NOTHING = BMLError("wanted <bml>, or a text to speak, got nothing", line=1)
WANTED = "BML, a text, bytes, a pathlib.Path, or a list of these"


class Document(NamedTuple):
    """A document of a source: its content as BML, and the name of its file or ""."""

    bml: str | bytes
    file: str


def is_file_name(text: str) -> bool:
    """Return whether a text names a file: by its suffix, a path separator, or because it exists.

    Several words are one only if it exists, or if they end in a suffix of BML or a timeline: others are
    spoken, as are words without suffix and separator.
    """
    if "<" in text or len(text) > LONGEST_PATH:
        return False
    is_path = any(s in text for s in (os.sep, os.altsep) if s)
    named = text.lower().endswith(SUFFIXES + SOUNDS) or is_path
    if len(text.split()) == 1 or text.lower().endswith(SUFFIXES[1:]):
        return named or (bool(Path(text).suffix) and _is_readable(Path(text)))
    return (is_path or bool(Path(text).suffix)) and _is_readable(Path(text))


def documents_of(source: Source | Iterable[Source]) -> list[Document]:
    """Return the documents of a source, in order. Texts that are spoken are appended to each other.

    Raises:
        FileNotFoundError: there is no such file; OSError: it cannot be read.
        TypeError: the source is of another type.
        ValueError: there is no document.
    """
    if isinstance(source, Source):
        return [document_of(source)]
    if not isinstance(source, Iterable) or isinstance(source, (dict, set, bytearray, memoryview)):
        raise TypeError(f"source: wanted {WANTED}, got {_type(source)}")
    documents = [document_of(item, number) for number, item in enumerate(source, 1)]
    if not documents:
        raise ValueError(f"source: wanted {WANTED}, got no document")
    return documents


def folder_of(files: Iterable[str]) -> Path | None:
    """Return the folder in which all of these files are, where documents then find files; else None.

    Texts, BML and names of no file, such as "-", have no folder.
    """
    paths = [Path(file) for file in files if is_file_name(file)]
    folders = {path.resolve().parent for path in paths if path.is_file()}
    return folders.pop() if len(folders) == 1 else None


def first_error(documents: Sequence[Document], vocabulary: Vocabulary, *, strict_bml: bool) -> BMLError:
    """Return the error of documents of which none can be read; its text names the file."""
    parts = ((part, d) for d in documents for part in read(d.bml, vocabulary, strict_bml=strict_bml))
    found = ((part, d) for part, d in parts if isinstance(part, BMLError))
    error, document = next(found, (NOTHING, documents[0]))
    text = f"{error.text} (in {document.file})" if document.file else error.text
    return type(error)(text, line=error.line, path=error.path, block=error.block)


def spoken(text: str, number: int = 1) -> str:
    """Return the document that speaks a text after those of smaller numbers; several for a long text."""
    blocks = []
    for k, piece in enumerate(_PIECE.findall(text) if len(text) > LONGEST else [text]):
        speech = Speech(id="speech", text=SpeechText(parts=(piece,)))
        id = f"text{number}-{k + 1}" if k else f"text{number}"
        blocks.append(write(Block(id=id, composition="APPEND", children=(speech,))))
    return "".join(blocks)


def recorded(file: str, number: int = 1) -> str:
    """Return the document that plays a sound file of the media folder; the lips follow its sound."""
    audio = f'<audiofile xmlns="{BMLT}" fileName={quoteattr(file)}/>'
    speech = f'<speech id="speech"><description priority="1" type="audio">{audio}</description></speech>'
    return f'<bml xmlns="{CORE}" id="text{number}" composition="APPEND">{speech}</bml>'


def document_of(item: object, number: int = 1) -> Document:
    """Return the document of one source; `number` is its place among several. Errors as `documents_of`."""
    if not isinstance(item, Source):
        raise TypeError(f"source: wanted {WANTED}, got {_type(item)}")
    if isinstance(item, str) and is_file_name(item):
        if not _is_readable(Path(item)):
            words = "no such file; a single word with / or such an end is the name of one, not spoken"
            raise FileNotFoundError(errno.ENOENT, words, item)
        item = Path(item)
    if isinstance(item, Path):
        if item.suffix.lower() in SOUNDS and item.is_file():
            return Document(recorded(item.name, number), str(item))
        content, is_text = item.read_bytes(), item.suffix.lower() == ".txt"
        if format_of(content):  # with another suffix
            return Document(recorded(item.name, number), str(item))
        return Document(_bml(content, number) if is_text else content, str(item))
    return Document(_bml(item, number), "")


def _is_readable(path: Path) -> bool:
    """Return whether there is a file, or a pipe, of this name."""
    try:
        return path.exists() and not path.is_dir()
    except (OSError, ValueError):  # no possible name
        return False


def _bml(content: str | bytes, number: int) -> str | bytes:
    """Return the document that speaks a text; BML, blanks and other bytes stay as they are."""
    try:
        text = content if isinstance(content, str) else content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return content
    return spoken(text, number) if text.strip() and "<" not in text else content


def _type(value: object) -> str:
    return f"{type(value).__name__}: {value!r:.60}"
