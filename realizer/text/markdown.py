"""Markdown: the blocks that lines begin, and the words of a line.

markdown-it reads both. A block is known from the signs at the beginning of its first line, so that text
can be spoken while it arrives.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache

from markdown_it import MarkdownIt
from markdown_it.rules_inline import StateInline
from markdown_it.token import Token

from realizer.text.parts import BEGUN, TAG

# Signs and numbers at the beginning of a line, of which block markup consists.
BEGINNING = re.compile(r"(?:[ \t#>*+_~`=|:.)•‣◦▪●○-]|[0-9])*")
BULLETS = re.compile(r"^(\s*(?:>\s*)*)[•‣◦▪●○](?=\s)")
TASK = re.compile(r"\[[ xX]\]\s")
LABEL = re.compile(r"\[(\^?)[^\]\n]+\]:")  # of a footnote, or of an address
FENCE = re.compile(r"```|~~~")
COMMENT = re.compile(r"<!--.*?-->", re.DOTALL)
LONGEST_DIRECTION = 60  # characters
# Most text with signs is of these kinds, for which no parser is needed: text without markup, emphasis,
# code or a link around all of the words, and markup of which only the beginning is there.
NO_MARKUP = re.compile(r"[^*_~`\[\]<\\&\r\n]*")
_WITHIN = r"[^*_~`\[\]()<\\&!\r\n]"
EMPHASIS = re.compile(rf"(\*\*?)([^\W_](?:{_WITHIN}*[^\W_])?[.!?]?)\1([.,!?:;]*[^\S\r\n])")
LINK = re.compile(rf"\[({_WITHIN}+)\]\(https?://[\w./?=#-]+\)([.,!?:;]*[^\S\r\n])")
CODE = re.compile(r"`([^\s`](?:[^`\r\n]*[^\s`])?)`([.,!?:;]*[^\S\r\n])")
BEGUN_MARKUP = re.compile(rf"\*\*?(?=\w){_WITHIN}*|(?=[^\[]*\[)[^*_~`\]<\\&\r\n]*")
OPEN_BRACKET = re.compile(rf"\([^()]{{0,{LONGEST_DIRECTION}}}$")


@dataclass(frozen=True, slots=True)
class Piece:
    """Words of a paragraph, or a tag: `kind` is text, em, code, address or tag."""

    kind: str
    text: str


@dataclass(frozen=True, slots=True)
class LineStart:
    """What a line begins: paragraph, heading, item, quote, row, rule or fence.

    Attributes:
        length: number of characters of markup.
        says: words for them, such as the number of an item.
    """

    kind: str
    length: int
    says: str = ""


@cache
def _parser() -> MarkdownIt:
    parser = MarkdownIt("commonmark", {"html": False}).enable(["strikethrough", "table"])
    # Lines below a heading are read one by one, references have no words, and text is often indented.
    parser.disable(["code", "lheading", "reference", "html_block"])
    parser.inline.ruler.before("autolink", "tag", _tag)
    parser.normalizeLink = str  # type: ignore[method-assign, assignment]  # no one says an address
    return parser


def _tag(state: StateInline, silent: bool) -> bool:
    if state.src[state.pos] != "<":
        return False
    found = COMMENT.match(state.src, state.pos) or TAG.match(state.src, state.pos)
    if found is None:
        return False
    if not silent:
        state.push("tag", "", 0).content = "" if found[0].startswith("<!") else found[0]
    state.pos = found.end()
    return True


@lru_cache(maxsize=1000)
def line_start(signs: str) -> LineStart:
    """Return what a line begins whose words follow these signs, which match BEGINNING."""
    signs = BULLETS.sub(r"\1-", signs)
    tokens = _parser().parse(signs + "x")
    kinds = [token.type.removesuffix("_open") for token in tokens]
    content = next((token.content for token in tokens if token.type == "inline"), "")
    length = len(signs) + 1 - len(content)
    if "fence" in kinds:
        return LineStart("fence", 0)
    if signs[length : length + 1] == "|":
        return LineStart("row", length)
    if "heading" in kinds:
        return LineStart("heading", length)
    if "list_item" in kinds:
        number = next(token.info for token in reversed(tokens) if token.type == "list_item_open")
        return LineStart("item", length, f"{number}: " if number else "")
    return LineStart("quote" if "blockquote" in kinds else "paragraph", length)


def fence_end(line: str) -> re.Pattern[str] | None:
    """Return what ends the block of code that a line begins, or None if it begins none."""
    token = next((token for token in _parser().parse(line) if token.type == "fence"), None)
    if token is None:
        return None
    return re.compile(rf"[\s>]*{re.escape(token.markup[0])}{{{len(token.markup)},}}\s*")


def has_words(line: str) -> bool:
    """Return whether a line of signs and numbers is more than markup, such as "2024"."""
    if not any(map(str.isalnum, line)):
        return False
    content = [token.content for token in _parser().parse(line) if token.type == "inline"]
    return any(any(map(str.isalnum, text)) for text in content)


def cells(row: str) -> list[str]:
    """Return the cells of a row of a table."""
    count = len(re.findall(r"(?<!\\)\|", row))
    for columns in (count - 1, count, count + 1):
        tokens = _parser().parse(f"{row}\n{'|-' * columns}|\n") if columns > 0 else []
        if tokens and tokens[0].type == "table_open":
            return [token.content for token in tokens if token.type == "inline"]
    return [row.replace("|", " ")]


def read_inline(text: str) -> tuple[list[Piece], bool]:
    """Return the pieces of a text without line starts, and whether markup that begins in it is still open."""
    return read_plain(text) or parse_inline(text)


def parse_inline(text: str) -> tuple[list[Piece], bool]:
    """Return what `read_inline` gives, by the parser."""
    tokens: list[Token] = []
    parser = _parser()
    state = StateInline(text, parser, {}, tokens)
    parser.inline.tokenize(state)
    for rule in parser.inline.ruler2.getRules(""):
        rule(state)
    is_open = any(found.open and found.end < 0 for found in state.delimiters)
    literal = "".join(token.content for token in tokens if token.type == "text")
    is_open = is_open or "`" in literal or literal.count("[") > literal.count("]")
    is_open = is_open or bool(BEGUN.search(literal)) or bool(OPEN_BRACKET.search(literal))
    return _pieces(tokens), is_open


def read_plain(text: str) -> tuple[list[Piece], bool] | None:
    """Return what `read_inline` gives for markup of the simplest kinds, or None; the parser is slow."""
    if NO_MARKUP.fullmatch(text):
        return [Piece("text", text)], bool(OPEN_BRACKET.search(text))
    if BEGUN_MARKUP.fullmatch(text):
        return [Piece("text", text)], True
    if found := EMPHASIS.fullmatch(text):
        return [Piece("em" if found[1] == "*" else "text", found[2]), Piece("text", found[3])], False
    if found := CODE.fullmatch(text):
        return [Piece("code", found[1]), Piece("text", found[2])], False
    if found := LINK.fullmatch(text):
        return [Piece("text", found[1]), Piece("text", found[2])], False
    return None


def _pieces(tokens: Sequence[Token]) -> list[Piece]:
    pieces: list[Piece] = []
    emphasis: list[int] = []  # where open emphasis begins
    for token in tokens:
        match token.type:
            case "text" | "text_special":
                pieces.append(Piece("text", token.content))
            case "softbreak" | "hardbreak":
                pieces.append(Piece("text", " "))
            case "code_inline":
                pieces.append(Piece("code", token.content))
            case "image":
                pieces += _pieces(token.children or ())
            case "tag":
                pieces.append(Piece("tag", token.content))
            case "em_open":
                emphasis.append(len(pieces))
            case "em_close":
                begin = emphasis.pop()
                inside = pieces[begin:]
                if inside and all(piece.kind == "text" for piece in inside):
                    pieces[begin:] = [Piece("em", "".join(piece.text for piece in inside))]
    return pieces
