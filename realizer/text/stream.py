"""Text that is read as it arrives: Markdown, stage directions and emoji become words and behaviours."""

import re
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from typing import Literal, NamedTuple

from realizer.text.markdown import (
    BEGINNING,
    FENCE,
    LABEL,
    TASK,
    Piece,
    cells,
    fence_end,
    has_words,
    line_start,
    read_inline,
)
from realizer.text.marks import (
    PICTURES,
    SPEECH,
    belongs_to_sentence,
    direction,
    element_names,
    emoticons,
    in_brackets,
    in_parentheses,
    is_direction,
    is_named,
    is_third_person,
    of_emoticon,
    of_picture,
)
from realizer.text.numbers import complete, numbers_in_words
from realizer.text.parts import Part, Tag, joined

MAX_HELD = 400  # characters; markup that is open for longer is none
MAX_BRACKETS = 20  # in markup that is open
MAX_LINE = 2000  # characters; longer lines of code and rows of tables are read in pieces
BEFORE = 80  # characters of what was spoken before
# Signs of markup. Other text needs no parser.
SPECIAL = re.compile(r"[*_~`\[\]()<>\\&!]")
PLAIN = re.compile(r"[\w\s.,;:'’?!…\"-]*")
BLANK = re.compile(r"\s")
BRACKET = re.compile(r"\[")
ENDED = re.compile(r"[.!?…:;,。！？、，；：۔؟।][\"'”’»)\]]*\s*$")
# An address; its group is the host, which people say instead of it.
ADDRESS = re.compile(
    r"(?:https?://(?:[^\s/@<>]*@)?(?:www\.)?|\bwww\.)([^\s/?#:<>\"'`()\[\]*_]*\w)(?:[:/?#][^\s<>\"'`]*[^\s<>\"'`.,;:!?)\]*_])?",
    re.IGNORECASE,
)
DEFINITION = re.compile(r"\[[^\]\n]+\]:\s*<?(?:[a-z]+:|www\.|/|#|\.)", re.IGNORECASE)
BEGUN_LABEL = re.compile(r"\[[^\]\n]{0,200}(?:\]:?)?$")
REFERENCE = re.compile(r"\[([^\[\]]+)\]\[[^\[\]]*\]")  # a link whose address is elsewhere
CITATION = re.compile(r"\^[^\]]*|[0-9]+(?:\s*[,–-]\s*[0-9]+)*")
BRACKETS = re.compile(r"\[([^\[\]]{1,60})\]|\(([^()]{1,60})\)")
# Signs that no one says: what is left of markup, arrows, and a hash before a word.
UNSAID = re.compile(r"(?<!\S)\|(?!\S)|[→⇒➜]|(?<!\S)(?:-{1,2}|=)>(?!\S)|#(?=[^\W\d])|\\")
JOINERS = "\ufe0f\u200d"  # that join and colour pictures, and show nothing alone
NAME = re.compile(r"</?([\w-]+)(:?)")


class Tried(NamedTuple):
    """How far words were read in which markup is open, so that they are not read again for each new line.

    Attributes:
        length: number of characters.
        ends: number of ends that were found in them.
        checked: the number of the last end up to which they were parsed.
    """

    length: int = 0
    ends: int = 0
    checked: int = 0


class TextStream:
    """A reader of text in pieces of any size; what it returns together is what the whole text gives.

    It holds back what may still be markup, until the end of a paragraph at the latest.

    Args:
        language: BCP-47 tag, for numbers.
        emoji: whether emoji and emoticons that are known become behaviours.
        code: "skip" leaves blocks of code out, "say" says "code" for each.

    Attributes:
        warnings: sentences about what is not spoken.
    """

    def __init__(
        self, language: str = "en", *, emoji: bool = True, code: Literal["skip", "say"] = "skip"
    ) -> None:
        self.warnings: list[str] = []
        self._language = language
        self._emoji = emoji
        self._code = code
        self._source = ""  # not read
        self._open = ""  # words of a paragraph in which markup may be open
        self._tried = Tried()
        self._before = ""  # the last words of the paragraph
        self._unsaid = ""  # words with numbers that may go on
        self._said = ""  # the last words that were returned
        self._kind: str | None = None  # of the block that is read
        self._begins = True  # whether a line begins
        self._fence: re.Pattern[str] | None = None

    def feed(self, text: str, *, close: bool = False) -> list[Part]:
        """Add text and return what is spoken of it so far.

        Args:
            close: whether this is the end of the text.
        """
        self._source += text
        held = "\r" if self._source.endswith("\r") and not close else ""
        self._source = self._source.removesuffix(held).replace("\r\n", "\n").replace("\r", "\n")
        found: list[Part] = []
        while self._source:
            if self._fence is not None:
                is_read = self._skip_code(self._fence, close=close)
            elif self._begins:
                is_read = self._begin_line(found, close=close)
            else:
                line, end, self._source = self._source.partition("\n")
                self._open += line
                self._begins, is_read = bool(end), True
                found += self._release(closed=False)
                if self._kind == "heading" and end:
                    self._end_block(found)
            if not is_read:
                break
        self._source += held
        if close:
            self._end_block(found, is_last=True)
        return self._in_words(found, close=close)

    # lines --------------------------------------------------------------------------------------

    def _begin_line(self, found: list[Part], *, close: bool) -> bool:
        """Read the markup at the beginning of a line; return False if more of it may come."""
        source = self._source
        is_whole = close or "\n" in source or len(source) > MAX_LINE
        match = BEGINNING.match(source)
        signs = match[0] if match else ""
        if len(signs) == len(source) and not is_whole:
            return False
        label = LABEL.match(source, len(signs))
        is_begun = BEGUN_LABEL.match(source, len(signs)) or FENCE.search(signs) or "|" in signs or label
        if is_begun and not is_whole:
            return False
        line, end, rest = source[:MAX_LINE].partition("\n")
        rest += source[MAX_LINE:]
        if FENCE.search(signs) and (fence := fence_end(line)) is not None:
            self._end_block(found)
            self._fence, self._source = fence, rest
            self._warn_of_code(found)
            return True
        if len(signs) >= len(line) and not has_words(line):  # a blank line, a rule, or the line below a title
            if line.strip() or end:
                self._end_block(found)
            self._source = rest
            return True
        if label is not None:
            self._end_block(found)
            if not label[1] and DEFINITION.match(line, len(signs)):
                self._source = rest
            else:
                self._kind, self._begins = "paragraph", False
                self._source = source[label.end() if label[1] else len(signs) :]
            return True
        # Of a line such as "- 5", the last word is none of the signs.
        begin = line_start(
            signs if len(signs) < len(line) else line[: _last_blank(line, 0, len(line.rstrip()))]
        )
        if begin.kind == "row":
            self._end_block(found)
            self._kind, self._source = "row", rest
            for number, cell in enumerate(cells(line[begin.length :])):
                self._open += f", {cell}" if number and cell else cell
            self._end_block(found)
            return True
        # As in CommonMark, a number begins a list inside of a paragraph only if it is 1.
        is_number = bool(begin.says) and self._kind == "paragraph" and begin.says != "1: "
        if (is_number or begin.kind in ("paragraph", "quote")) and self._kind not in (None, "row"):
            self._open += " "
        else:
            self._end_block(found)
            self._kind, self._open = ("paragraph", "") if is_number else (begin.kind, begin.says)
        source = source[0 if is_number else begin.length :].lstrip(" \t")
        task = TASK.match(source) if begin.kind == "item" else None
        self._source = source[task.end() if task else 0 :]
        self._begins = False
        return True

    def _skip_code(self, fence: re.Pattern[str], *, close: bool) -> bool:
        line, end, rest = self._source.partition("\n")
        if not end and not close and len(line) <= MAX_LINE:
            return False
        if (end or close) and fence.fullmatch(line):
            self._fence = None
        self._source = rest
        return True

    def _warn_of_code(self, found: list[Part]) -> None:
        if self._code == "say":
            found.append("code. ")
        else:
            self.warnings.append("a block of code is not spoken")

    def _end_block(self, found: list[Part], *, is_last: bool = False) -> None:
        """End a paragraph; a heading, an item and a row end like a sentence."""
        found += self._release(closed=True)
        if self._kind is not None:
            if self._before.strip() and not ENDED.search(self._before):
                has_stop = self._kind not in ("paragraph", "quote") or not is_last
                if has_stop:
                    found.append(".")
            if not is_last:
                found.append("\n\n")
            self._before = ""
        self._kind, self._begins = None, True

    # words --------------------------------------------------------------------------------------

    def _in_words(self, parts: Iterable[Part], *, close: bool) -> list[Part]:
        """Return parts with numbers in words, without those at the end that may go on."""
        found: list[Part] = []
        for part in parts:
            if isinstance(part, str):
                self._unsaid += part
            else:
                found += [self._say(len(self._unsaid)), part]
        is_whole = close or not self._unsaid
        length = len(self._unsaid) if is_whole else complete(self._unsaid, self._language)
        found.append(self._say(length))
        return joined(found)

    def _say(self, length: int) -> str:
        text, self._unsaid = self._unsaid[:length], self._unsaid[length:]
        words = numbers_in_words(text, self._language, self._said)
        self._said = (self._said + words)[-BEFORE:]
        return words

    def _release(self, *, closed: bool) -> list[Part]:
        """Return what is spoken of the open words up to markup that is not complete."""
        text, at = self._open, 0
        found: list[Part] = []
        while at < len(text):
            special = SPECIAL.search(text, at)
            until = len(text) if special is None else special.start()
            begin = until if special is None and closed else _last_blank(text, at, until)
            if begin > at:
                found += self._spoken([Piece("text", text[at:begin])])
                at = begin
            if special is None:
                break
            segment = _segment(text, at, self._tried, closed=closed)
            if isinstance(segment, Tried):
                self._tried = segment
                break
            at, pieces = segment
            self._tried = Tried()
            found += self._spoken(pieces)
        self._open = text[at:]
        return found

    def _spoken(self, pieces: Sequence[Piece]) -> Iterator[Part]:
        for number, piece in enumerate(pieces):
            if piece.kind == "em":
                parts: Iterable[Part] = self._emphasised(piece.text, pieces[number + 1 :])
            elif piece.kind == "tag":
                parts = _markup(piece.text)
            elif piece.kind == "code":
                parts = (piece.text,)
            else:
                parts = self._words(piece.text)
            for part in parts:
                if isinstance(part, str):
                    self._before = (self._before + part)[-BEFORE:]
                yield part

    def _emphasised(self, text: str, following: Sequence[Piece]) -> Iterable[Part]:
        """Return the behaviours of a stage direction, or else emphasised words."""
        if belongs_to_sentence(self._before):
            return self._words(text)
        speech = SPEECH.fullmatch(text)
        if speech is not None:
            head = direction(speech[1])
            if is_third_person(speech[1]) if head is None else not head.is_bare:
                return (*self._emphasised(speech[1], ()), " ", *self._words(speech[2]))
        known = direction(text)
        if known is not None:
            if not is_direction(known, self._before, _after(following)):
                return self._words(text)
            if known.unknown:
                self.warnings.append(f"the stage direction {known.unknown!r} is not known: it is left out")
            return known.shows
        after = "".join(piece.text for piece in following if piece.kind != "tag").lstrip()[:1]
        stands_alone = not self._before.strip() or bool(ENDED.search(self._before))
        if is_third_person(text) and stands_alone and not after.islower():
            self.warnings.append(f"the stage direction {text[:60]!r} is not known: it is left out")
            return ()
        return self._words(text)

    def _words(self, text: str) -> Iterable[Part]:
        """Return words without what no one says, and the behaviours of marks among them."""
        if PLAIN.fullmatch(text) and "_" not in text and ":" not in text and ";" not in text:
            return (text,)
        text = REFERENCE.sub(r"\1", ADDRESS.sub(r"\1", text))
        parts: list[Part] = []
        at = 0
        for found in BRACKETS.finditer(text):
            inside = found[1] or found[2]
            shown = in_brackets(inside) if found[1] else in_parentheses(inside)
            if shown is not None and found[1] and is_named(self._before + text[: found.start()]):
                continue
            if shown is not None or (found[1] and CITATION.fullmatch(inside)):
                parts += [text[at : found.start()], *(() if shown is None else (shown,))]
                at = found.end()
        parts.append(text[at:])
        return [part for old in parts for part in (self._signs(old) if isinstance(old, str) else (old,))]

    def _signs(self, text: str) -> Iterator[Part]:
        """Yield words and, for emoji and emoticons, behaviours."""
        at = 0
        signs = sorted((*PICTURES.finditer(text), *emoticons().finditer(text)), key=lambda sign: sign.start())
        for sign in signs:
            yield _without_signs(text[at : sign.start()])
            shown = of_picture(sign[0]) if PICTURES.fullmatch(sign[0]) else of_emoticon(sign[0])
            if shown is not None and self._emoji:
                yield shown
            elif self._emoji and (picture := sign[0].strip(JOINERS)):
                self.warnings.append(f"the emoji '{picture[:8]}' is not known: it is left out")
            if shown is None or not self._emoji:
                yield " "
            at = sign.end()
        yield _without_signs(text[at:])


def _segment(text: str, begin: int, tried: Tried, *, closed: bool) -> tuple[int, list[Piece]] | Tried:
    """Return the end of words whose markup is complete, and their pieces; else how far they were tried."""
    most = begin + MAX_HELD
    brackets = [found.start() for found in islice(BRACKET.finditer(text, begin, most), MAX_BRACKETS)]
    most = brackets[-1] + 1 if len(brackets) == MAX_BRACKETS else most
    while True:
        at = begin + tried.length
        special = SPECIAL.search(text, at, most)
        if special is None and len(text) <= most and not closed:
            return tried
        end = _first_blank(text, most if special is None else special.end(), most, closed=closed)
        if end is None:
            return tried
        count, checked = tried.ends + 1, tried.checked
        is_last = end >= most or (closed and end == len(text))
        if count > checked * 1.4 or is_last:
            checked = count
            pieces, is_open = read_inline(text[begin:end])
            if not (is_open or is_last) and _wants_next(pieces):
                end = _first_blank(text, end, most, closed=closed)
                if end is None:
                    return tried
                pieces, is_open = read_inline(text[begin:end])
            if not is_open or is_last:
                return end, pieces
        tried = Tried(end - begin, count, checked)


def _wants_next(pieces: Sequence[Piece]) -> bool:
    """Return whether what follows decides if the last piece is a stage direction."""
    last = [piece for piece in pieces if piece.text.strip()][-1:]
    if not last or last[0].kind != "em":
        return False
    known = direction(last[0].text)
    return is_third_person(last[0].text) or (known is not None and known.is_bare)


def _after(following: Sequence[Piece]) -> str:
    """Return the words after a direction; another direction ends them."""
    after = ""
    for piece in following:
        if piece.kind == "em" and direction(piece.text) is not None:
            break
        after += "" if piece.kind == "tag" else piece.text
    return after


def _first_blank(text: str, start: int, most: int, *, closed: bool) -> int | None:
    """Return the position behind the first blank from `start` on, or `most`, or the end of a whole text."""
    found = BLANK.search(text, start, most)
    if found is not None:
        return found.end()
    return most if len(text) > most else len(text) if closed else None


def _last_blank(text: str, start: int, end: int) -> int:
    """Return the position behind the last blank between two positions, or `start`."""
    at = end
    while at > start and not text[at - 1].isspace():
        at -= 1
    return at


def _markup(source: str) -> tuple[Part, ...]:
    """Return a tag; tags of HTML only separate words."""
    name = NAME.match(source)
    if name is None:
        return ()
    if not name[2] and name[1].lower() in element_names("html"):
        return ("\n",) if name[1].lower() in element_names("lines") else ()
    return (Tag(source, shows=name[1] not in element_names("ssml") and not source.startswith("</")),)


def _without_signs(text: str) -> str:
    text = UNSAID.sub(lambda sign: "," if sign[0] in "|→⇒➜->=>" else "", text)
    return re.sub(r"(?<=\w)_+(?=\w)", " ", text).replace("_", " ")
