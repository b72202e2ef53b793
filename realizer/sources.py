"""Sources of documents: BML, a text to speak, a file, or several of these."""

import codecs
import errno
import os
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from bml_schema import CORE, BMLError, Speech, SpeechText, read, write
from bml_schema.nodes import BMLT
from bml_schema.reading.element_reader import Vocabulary
from bml_schema.reading.encodings import decode, without_controls
from realizer.behaviours.speech import UNSAID
from realizer.core.sound_formats import SUFFIXES as SOUNDS
from realizer.core.sound_formats import format_of
from realizer.spoken_block import Chunk, text_block
from realizer.text.marks import element_names
from realizer.text.parts import Part, markup
from realizer.text.spoken import SpokenText, spoken_text

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
# What begins a document: an element that is neither SSML nor HTML inside of a text, or <bml> anywhere.
_BEGINNING = re.compile(r"[\s\ufeff]*<(?:[?!]|(?:[\w.-]+:)?([A-Za-z_][\w.-]*)(?=[\s/>]|$))")
_DOCUMENT = re.compile(r"<(?:[\w.-]+:)?(?:bml|speak|act|fml-apml)(?=[\s/>]|$)")
NOTHING_SPOKEN = "nothing in the text can be spoken"
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


def is_markup(text: str) -> bool:
    """Return whether a text is BML or another document, and not words with some markup in them."""
    begin = _BEGINNING.match(text)
    if begin is not None and begin[1] is None:
        return True
    inside = begin is None or begin[1].lower() in element_names("html") | element_names("ssml")
    return not inside or _DOCUMENT.search(text) is not None


def documents_of(
    source: Source | Iterable[Source], *, language: str = "en", plain: bool = False
) -> list[Document]:
    """Return the documents of a source, in order. Texts that are spoken are appended to each other.

    Args:
        language: BCP-47 tag of texts, for their numbers.
        plain: whether texts are spoken sign by sign, without Markdown, stage directions and the like.

    Raises:
        FileNotFoundError: there is no such file; OSError: it cannot be read.
        TypeError: the source is of another type.
        ValueError: there is no document.
    """
    if isinstance(source, Source):
        return [document_of(source, language=language, plain=plain)]
    if not isinstance(source, Iterable) or isinstance(source, (dict, set, bytearray, memoryview)):
        raise TypeError(f"source: wanted {WANTED}, got {_type(source)}")
    documents = [
        document_of(item, number, language=language, plain=plain) for number, item in enumerate(source, 1)
    ]
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


def spoken(text: str, number: int = 1, *, language: str = "en", plain: bool = False) -> str:
    """Return the document that speaks a text after those of smaller numbers; several for a long text."""
    text, controls = without_controls(text)
    said = SpokenText(text) if plain else spoken_text(text, language)
    warnings = "; ".join(filter(None, (controls, *said.warnings)))
    pieces = _divided((text,) if plain else said.parts)
    blocks = [text_block(markup(parts), Chunk("speech", number)) for parts in pieces]
    if not any(block.behaviours or block.problems for block in blocks):
        warnings = warnings or NOTHING_SPOKEN
    documents = []
    for k, block in enumerate(blocks):
        remarks = [*([warnings] if warnings and not k else ()), *(fault.text for fault in block.problems)]
        children = block.children
        if remarks:
            remark = {UNSAID: "; ".join(remarks)}
            if not any(isinstance(node, Speech) for node in children):
                # A speech without words carries what is left out.
                children = (Speech(id="speech", text=SpeechText()), *children)
            children = tuple(
                replace(node, unknown_attributes=remark) if isinstance(node, Speech) else node
                for node in children
            )
        id = f"text{number}-{k + 1}" if k else f"text{number}"
        documents.append(write(replace(block, id=id, composition="APPEND", children=children)))
    return "".join(documents)


def _divided(parts: Iterable[Part]) -> Iterator[list[Part]]:
    """Yield parts of a text of at most LONGEST characters, divided at ends of sentences."""
    found: list[Part] = []
    length = 0
    for part in parts:
        if isinstance(part, str) and length + len(part) > LONGEST:
            for piece in _PIECE.findall(part):
                if found and length + len(piece) > LONGEST:
                    yield found
                    found, length = [], 0
                found.append(piece)
                length += len(piece)
        else:
            found.append(part)
            length += len(part) if isinstance(part, str) else 0
    yield found


def recorded(file: str, number: int = 1) -> str:
    """Return the document that plays a sound file of the media folder; the lips follow its sound."""
    audio = f'<audiofile xmlns="{BMLT}" fileName={quoteattr(file)}/>'
    speech = f'<speech id="speech"><description priority="1" type="audio">{audio}</description></speech>'
    return f'<bml xmlns="{CORE}" id="text{number}" composition="APPEND">{speech}</bml>'


def document_of(item: object, number: int = 1, *, language: str = "en", plain: bool = False) -> Document:
    """Return the document of one source; `number` is its place among several, the rest as `documents_of`."""

    def of_text(content: str | bytes) -> str | bytes:
        text = content if isinstance(content, str) else text_in(content)
        if text is None or not text.strip() or is_markup(text):
            return content
        return spoken(text, number, language=language, plain=plain)

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
        return Document(of_text(content) if is_text else content, str(item))
    return Document(of_text(item), "")


def _is_readable(path: Path) -> bool:
    """Return whether there is a file, or a pipe, of this name."""
    try:
        return path.exists() and not path.is_dir()
    except (OSError, ValueError):  # no possible name
        return False


def text_in(content: bytes) -> str | None:
    """Return the text of bytes in UTF-8, UTF-16 or Windows-1252; None if they are none."""
    for pair, encoding in ((content[1::2], "utf-16-le"), (content[::2], "utf-16-be")):
        if content and 2 * pair.count(0) > len(pair):  # most letters have such a byte
            mark = content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
            return content.decode("utf-16" if mark else encoding, "replace")
    try:
        return decode(content)[0]
    except BMLError:
        return None


def _type(value: object) -> str:
    return f"{type(value).__name__}: {value!r:.60}"
