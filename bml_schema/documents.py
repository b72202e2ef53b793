"""The reader of documents: decoding, limits, well-formedness, several documents in one text."""

import re
from collections import deque
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from itertools import count
from typing import Any

from lxml import etree

from bml_schema.canonical import xml_parser
from bml_schema.dialects.intentions import FML_WRAPPER, fml_of
from bml_schema.dialects.recognition import has_words_of_dialects, is_draft
from bml_schema.errors import NOT_BML_1_0, BMLError, BMLSizeError, BMLSyntaxError, Fault
from bml_schema.node_schema import local
from bml_schema.nodes import CORE, Block
from bml_schema.reading.bare_signs import mend
from bml_schema.reading.document_splitter import (
    NEXT,
    WRAPPER_TAG,
    WRAPPERS,
    DocumentSpan,
    document_spans,
    without_doctype,
)
from bml_schema.reading.element_reader import ElementReader, Vocabulary
from bml_schema.reading.encodings import decode, is_declared, without_controls
from bml_schema.reading.parser import MAX_BEHAVIOURS, read_block
from bml_schema.reading.speech_rescue import rescue
from bml_schema.reading.ssml import document_of, start_of_speak
from bml_schema.reading.text_repair import repaired
from bml_schema.reading.undeclared_prefixes import read_undeclared
from bml_schema.vocabulary import VOCABULARY

MAX_BYTES = 1 << 20  # of one document; an hour of speech with a nod on every word has a third of it
_MAX_RETRIES = 20  # searches for a valid document inside a broken one
_MAX_SEARCHED = 100_000  # characters of one text that are searched again; more would take seconds
MAX_DOCUMENTS = 1000  # in one text, so that a text full of "<bml>" does not cause a flood of warnings


_LONG_TAG = re.compile(rb"<([^\s<>/!?]++)[^<>\n]*+\n[^<>]*+>")
_WORDS = re.compile(r"<(?:[\w.-]+:)?(?:text|speech)[\s/>]")
_ID = re.compile(r"""\sid\s*=\s*(?:"([^"<]*)"|'([^'<]*)')""")


def made_ids() -> Iterator[str]:
    """Yield ids for blocks without one: unnamed1, unnamed2 ..."""
    return (f"unnamed{n}" for n in count(1))


def parse(
    text: str | bytes,
    vocabulary: Vocabulary = VOCABULARY,
    *,
    strict: bool = False,
    max_bytes: int = MAX_BYTES,
    max_behaviours: int = MAX_BEHAVIOURS,
    strict_bml: bool = False,
) -> Block:
    """Return the block of a text that holds exactly one document.

    Args:
        text: the document, with or without namespace, with any prefix. Blanks, a BOM, a declaration and
            comments may precede it. Bytes are UTF-8, UTF-16 or Latin.
        vocabulary: Clark tag -> node class; extensions add their classes.
        strict: whether to raise a BMLError for the first problem.
        max_bytes, max_behaviours: limits of a document.
        strict_bml: whether to read BML 1.0 only, without dialects and lenient parsing.

    `parse_all` returns the blocks of several documents.

    Returns:
        The block; `problems` has what was dropped from it.

    Raises:
        BMLError: the text is not well-formed (BMLSyntaxError) or too big (BMLSizeError), its block has no
            usable id, or it is not one document.
        TypeError: `text` is neither str nor bytes.
    """
    blocks = parse_all(
        text,
        vocabulary,
        strict=strict,
        max_bytes=max_bytes,
        max_behaviours=max_behaviours,
        strict_bml=strict_bml,
    )
    if len(blocks) > 1:
        text = f"wanted one document, got {len(blocks)}; `bml_schema.parse_all` returns a list of them"
        raise BMLError(text)
    return blocks[0]


def parse_all(
    text: str | bytes,
    vocabulary: Vocabulary = VOCABULARY,
    *,
    strict: bool = False,
    max_bytes: int = MAX_BYTES,
    max_behaviours: int = MAX_BEHAVIOURS,
    strict_bml: bool = False,
) -> list[Block]:
    """Return the blocks of a text with one or more documents, in order.

    Arguments and errors are those of `parse`; the first document that cannot be read raises its error. `read`
    goes on after it.
    """
    if not isinstance(text, str | bytes):
        raise TypeError(f"text: wanted str or bytes, got {type(text).__name__}")
    blocks: list[Block] = []
    for found in read(
        text, vocabulary, max_bytes=max_bytes, max_behaviours=max_behaviours, strict_bml=strict_bml
    ):
        if isinstance(found, BMLError):
            raise found
        if strict and found.problems:
            problem = found.problems[0]
            raise BMLError(problem.text, line=problem.line, path=problem.path, block=found.id)
        blocks.append(found)
    if not blocks:
        raise BMLSyntaxError("wanted a <bml> document, got an empty text")
    return blocks


def read(
    text: str | bytes,
    vocabulary: Vocabulary = VOCABULARY,
    *,
    max_bytes: int = MAX_BYTES,
    max_behaviours: int = MAX_BEHAVIOURS,
    max_documents: int = MAX_DOCUMENTS,
    strict_bml: bool = False,
    block_ids: Iterator[str] | None = None,
) -> Iterator[Block | BMLError]:
    """Yield the blocks of a text with any number of documents, in order.

    After broken text, reading continues at the next `<bml`. Lines are counted over the whole text.

    Args:
        text, vocabulary, max_bytes, max_behaviours, strict_bml: as for `parse`.
        max_documents: after so many documents, reading ends with an error.
        block_ids: ids for documents of dialects without an id; they must be unique in a session.

    Yields:
        A Block for each document, and a BMLError for each part of the text without one.
    """
    block_ids = block_ids or made_ids()
    reader = _Reader(vocabulary, max_behaviours, strict_bml, block_ids)
    data, wrapper, roots = _parse_at_once(text, max_bytes, strict_bml)
    if 0 < len(roots) <= max_documents:
        reader.wrapper, begins = wrapper, _begins(data)
        if wrapper == FML_WRAPPER:
            reader.fml = fml_of(data.decode())
        for root in roots:
            try:
                yield reader.read(root, begins)
            except BMLError as error:
                yield error
        return
    try:
        if isinstance(text, bytes):
            text, note = decode(text, strict=strict_bml)
            reader.notes = (note,) if note else ()
        text = text if strict_bml else without_doctype(text)
        spans = list(document_spans(text))
    except BMLError as error:
        yield error
        return
    if "<fml" in text and not strict_bml:
        reader.fml = fml_of(text)
        if reader.fml is not None and not any(span.tag for span in spans):
            reader.wrapper = FML_WRAPPER
            yield reader.read(etree.Element("bml"), {})
            return
    if not strict_bml and not any(span.tag for span in spans) and (start := start_of_speak(text)) >= 0:
        try:
            yield _spoken(text[start:], text.count("\n", 0, start), reader, max_bytes)
        except BMLError as error:
            yield error
        return
    if spans and not strict_bml and (around := WRAPPER_TAG.search(text, 0, spans[0].start)):
        reader.wrapper = around[1]
    line = 1
    counted = 0
    broken = False  # whether the span before was broken XML, which all text up to the next document continues
    pending = deque(spans)
    retries, searched = _MAX_RETRIES, 0
    reported = 0  # end of the broken XML that was reported
    for n in count():
        if not pending:
            return
        span = pending.popleft()
        line += text.count("\n", counted, span.start)
        counted = span.start
        if n == max_documents:
            yield BMLError(f"wanted at most {n} documents in one text; the rest is not read", line=line)
            return
        if broken and span.fault and not span.tag:
            continue
        try:
            block = _block(text, span, line, reader, max_bytes)
        except BMLError as error:
            broken = isinstance(error, BMLSyntaxError)
            if not (broken and span.start < reported):
                yield error
            if broken and not span.fault and retries and searched < _MAX_SEARCHED:
                # A valid document may be inside the broken one, if their end tags match by chance.
                inner = NEXT.search(text, span.start + len(span.tag), span.end)
                if inner is not None:
                    retries -= 1
                    searched += span.end - inner.start()
                    reported = max(reported, span.end)
                    pending.extendleft(reversed(list(document_spans(text, inner.start(), span.end))))
        else:
            broken = False
            yield block


def _parse_at_once(
    text: str | bytes, max_bytes: int, strict_bml: bool
) -> tuple[bytes, str, list[etree._Element]]:
    """Return the bytes of a text, its wrapper and its documents if it is well-formed, otherwise no documents.

    Most texts are one well-formed document, which is parsed in one pass. All others are read again slowly, to
    find their faults.
    """
    if len(text) > max_bytes:
        return b"", "", []
    if isinstance(text, str):
        try:
            data = text.encode()
        except UnicodeEncodeError:
            return b"", "", []
    elif is_declared(text):
        return b"", "", []
    else:
        data = text
    if len(data) > max_bytes or b"<!DOCTYPE" in data:
        return data, "", []
    try:
        root = etree.fromstring(data, _PARSER)
    except etree.XMLSyntaxError:
        return data, "", []
    name = local(str(root.tag))
    if name == "bml":
        return data, "", [root]
    # SmartBody's messages: <act><participant/><bml>..</bml></act>.
    wrapped = name == "act" or (name in WRAPPERS and not strict_bml)
    return data, name, [child for child in root if local(str(child.tag)) == "bml"] if wrapped else []


def _begins(data: bytes) -> dict[tuple[int, str], int]:
    """Return (last line, name) -> first line of each start tag of several lines; lxml has the last."""
    begins: dict[tuple[int, str], int] = {}
    if data.count(b"\n") == data.count(b">\n"):
        return begins  # every line ends with a tag
    line, counted = 1, 0
    for match in _LONG_TAG.finditer(data):
        start, end = match.span()
        line += data.count(b"\n", counted, start)
        counted = start
        name = match[1].rpartition(b":")[2].decode(errors="replace")
        begins.setdefault((line + data.count(b"\n", start, end), name), line)
    return begins


@dataclass
class _Reader:
    """Reads the documents of one text, as BML 1.0 or as a dialect of it."""

    vocabulary: Vocabulary
    max_behaviours: int
    strict_bml: bool
    block_ids: Iterator[str]
    wrapper: str = ""  # local name of the element around the documents
    notes: tuple[str, ...] = ()  # about the whole text, for the first document
    fml: Any = None  # the <fml> of the text, for the first document, or None

    def read(
        self,
        root: etree._Element,
        begins: Mapping[tuple[int, str], int],
        *,
        lines_before: int = 0,
        notes: tuple[str, ...] = (),
    ) -> Block:
        """Read the block of a <bml> element; raise BMLError if there is none."""
        block = partial(
            read_block,
            root,
            self.vocabulary,
            lines_before=lines_before,
            begins=begins,
            max_behaviours=self.max_behaviours,
            lenient=not self.strict_bml,
        )
        if self.strict_bml:
            return self._read_strictly(root, block)
        plain: Block | BMLError | None = None
        if not self.wrapper and not is_draft(root):
            # Nearly all documents are BML 1.0. Others have faults, or words that occur in dialects only.
            try:
                plain = block(notes=notes)
            except BMLError as error:
                plain = error
            if isinstance(plain, Block) and not plain.problems and not has_words_of_dialects(plain):
                return plain
        from bml_schema.dialects.translator import translate, translate_elements

        for node in root.iter() if begins else ():
            # Translation may change the names by which `begins` finds lines.
            any_node: Any = node
            line = any_node.sourceline
            any_node.sourceline = begins.get((line, local(str(node.tag))), line)
        is_core = plain is not None and str(root.tag).startswith(f"{{{CORE}}}")
        report = "" if is_core else translate(root, self.wrapper, self.block_ids, self.fml).text
        self.fml = None
        # A document in the namespace of BML 1.0 stays that, whatever some of its elements are.
        parts = translate_elements(root) if is_core else {}
        report = report or parts.pop(root, "")
        if isinstance(plain, BMLError) and not report:
            raise plain
        rescued = rescue(root, ElementReader(self.vocabulary))
        for part, text in parts.items():
            rescued.setdefault(part, []).append(Fault(text, part, NOT_BML_1_0))
        if isinstance(plain, Block) and not (report or rescued or _speech_is_lost(plain)):
            return plain
        begins = {} if report or parts else begins
        return block(begins=begins, notes=(*notes, report) if report else notes, rescued=rescued)

    def _read_strictly(self, root: etree._Element, block: Callable[..., Block]) -> Block:
        """Read BML 1.0 only; if there are faults, say of which dialect they are words."""

        def dialect() -> str:
            from bml_schema.dialects.translator import dialect_of

            return dialect_of(root, self.wrapper)

        try:
            plain = block()
        except BMLError as error:
            if name := dialect():
                text = f"{error.text}; {_NOT_READ.format(name)}"
                raise type(error)(text, line=error.line, path=error.path, block=error.block) from None
            raise
        if plain.problems and (name := dialect()):
            return block(notes=(_NOT_READ.format(name),))
        return plain


def _speech_is_lost(block: Block) -> bool:
    return any(p.dropped and "/speech[" in p.path for p in block.problems)


_NOT_READ = "this is {}, which is not read in strict BML"


def _block(text: str, span: DocumentSpan, line: int, reader: _Reader, max_bytes: int) -> Block:
    match = _ID.search(span.tag)
    id = (match[1] or match[2]) if match else None
    if span.fault:
        raise BMLSyntaxError(span.fault, line=line, block=id)
    document = text[span.start : span.end]
    if not reader.strict_bml and _WORDS.search(document):
        document, note = without_controls(document)
        reader.notes = (*reader.notes, note) if note else reader.notes
    data = _encoded(document, line, id)
    if len(data) > max_bytes:
        raise BMLSizeError(
            f"wanted at most {max_bytes} bytes in a document, got {len(data)}", line=line, block=id
        )
    notes, reader.notes = reader.notes, ()
    try:
        root = element(data, lines_before=line - 1, block=id)
    except BMLSyntaxError as error:
        found = None if reader.strict_bml else _repaired(document, reader, error)
        if found is None:
            raise
        root, data, more = found
        notes = (*notes, *more)
    return reader.read(root, _begins(data), lines_before=line - 1, notes=notes)


def _repaired(
    document: str, reader: _Reader, error: BMLSyntaxError
) -> tuple[etree._Element, bytes, tuple[str, ...]] | None:
    """Return the root of a document that is not well-formed, its text and notes; None if it has no words.

    Its words are read in any case, and of the rest what can be read.
    """
    notes: tuple[str, ...] = ()
    for repair in (repaired, mend):
        document, note = repair(document)
        found = read_undeclared(document.encode(), reader.vocabulary)
        notes = (*notes, note) if note else notes
        if found is not None:
            return found[0], document.encode(), (*notes, found[1]) if found[1] else notes
    root: Any = etree.fromstring(document.encode(), xml_parser(recover=True))
    texts = [] if root is None or local(str(root.tag)) != "bml" else root.iter("{*}text", "{*}speak")
    if not any("".join(text.itertext()).strip() for text in texts):
        return None
    return root, document.encode(), (*notes, f"{error.text}: what can be read of it plays")


def _spoken(text: str, lines_before: int, reader: _Reader, max_bytes: int) -> Block:
    """Read a <speak> document; if it is not well-formed, what can be read of it, with a note."""
    data = _encoded(text, 1, None)
    if len(data) > max_bytes:
        raise BMLSizeError(f"wanted at most {max_bytes} bytes in a document, got {len(data)}", line=1)
    notes: tuple[str, ...] = ()
    try:
        root = element(data, lines_before=lines_before)
    except BMLSyntaxError as error:
        root = etree.fromstring(mend(repaired(text)[0])[0].encode(), xml_parser(recover=True))
        notes = (f"{error.text} in <speak>: what can be read of it is spoken",)
    document = document_of(root, next(reader.block_ids))
    return reader.read(document, {}, lines_before=lines_before, notes=notes)


_PARSER = xml_parser()


def element(data: bytes, *, lines_before: int = 0, block: str | None = None) -> etree._Element:
    """Return the root of a document in UTF-8 without prolog; raise BMLSyntaxError if not well-formed."""
    try:
        return etree.fromstring(data, _PARSER)
    except etree.XMLSyntaxError as error:
        line = (error.lineno or 1) + lines_before
        reason = re.sub(r",? line \d+, column \d+.*", "", error.msg or "no XML", flags=re.DOTALL)
        if "xcessive depth" in reason:
            reason = "elements nested too deep, wanted at most 256"
        raise BMLSyntaxError(f"not well-formed: {reason}", line=line, block=block) from None


def _encoded(document: str, line: int, block: str | None) -> bytes:
    try:
        return document.encode()
    except UnicodeEncodeError as error:
        line += document.count("\n", 0, error.start)
        text = f"wanted characters XML can hold, got U+{ord(document[error.start]):04X}"
        raise BMLSyntaxError(text, line=line, block=block) from None
