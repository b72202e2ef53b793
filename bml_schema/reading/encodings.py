"""The text of bytes, by what they are: byte order mark, declaration, or else what can be read."""

import codecs
import re

from bml_schema.errors import BMLSyntaxError, quoted

_DECLARED = re.compile(rb"""<\?xml[^>]*?encoding\s*=\s*["']([A-Za-z0-9._-]+)["']""")
_MARKS = (
    (codecs.BOM_UTF32_LE, "utf-32"),
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
    (codecs.BOM_UTF8, "utf-8-sig"),
    (b"<\0", "utf-16-le"),
    (b"\0<", "utf-16-be"),
)
_OF_BYTES = {
    "ascii",
    "koi8-r",
    "koi8-u",
    *(f"cp125{n}" for n in range(9)),
    *(f"iso8859-{n}" for n in range(1, 17)),
}
# Some of Python's other codecs are slow enough for an attack.
_CODECS = _OF_BYTES | {
    *("utf-8", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "shift_jis", "cp932", "euc_jp", "iso2022_jp"),
    *("gb2312", "gbk", "gb18030", "big5", "cp950", "euc_kr", "cp949"),
}
# Programs that say these write Windows-1252, which has letters and quotes where these have controls.
_WINDOWS = {"ascii": "cp1252", "iso8859-1": "cp1252"}
_BINARY = re.compile(rb"[\x00-\x08\x0e-\x1f]")
# What XML cannot hold, as itself and as a reference.
_FORBIDDEN = re.compile("[\x00-\x08\x0b\x0c\x0e-\x1f\ud800-\udfff\ufffe\uffff]")
_REFERENCE = re.compile(r"&#(?:[0-9]{1,9}|[xX][0-9a-fA-F]{1,8});")


def is_declared(data: bytes) -> bool:
    """Return whether a document in bytes declares its encoding."""
    return _DECLARED.match(data.removeprefix(codecs.BOM_UTF8).lstrip()) is not None


def decode(data: bytes, *, strict: bool = False) -> tuple[str, str]:
    """Return the text of bytes, and how it was read if they are not what they declare, or "".

    Args:
        strict: whether to believe the declaration in any case.

    Raises:
        BMLSyntaxError: bytes that are no text, or in a strange encoding.
    """
    mark = next((name for start, name in _MARKS if data.startswith(start)), "")
    found = _DECLARED.match(data.removeprefix(codecs.BOM_UTF8).lstrip())
    said = mark or (found[1].decode() if found else "utf-8")
    encoding = _known(said)
    if strict or mark:
        return _decoded(data, encoding or said), ""
    is_utf8 = _fits(data, "utf-8")
    declared = f"the encoding {quoted(said)} is declared" if found else "no encoding is declared"
    if is_utf8 and (not encoding or encoding in _OF_BYTES or encoding.startswith("utf-")):
        ours = encoding == "utf-8" or (encoding in _OF_BYTES and data.isascii())
        return data.decode(), "" if ours else f"{declared}; read as UTF-8, which it is"
    if encoding in ("utf-8", "utf-16", "utf-32") and not _BINARY.search(data) and _fits(data, "cp1252"):
        return data.decode("cp1252"), f"{declared}; read as Windows-1252, as it is not {said.upper()}"
    for one in filter(None, (_WINDOWS.get(encoding), encoding)):
        if _fits(data, one):
            return data.decode(one), ""
    return _decoded(data, encoding or said), ""


def _known(said: str) -> str:
    """Return the name of a codec that is used here, or ""."""
    try:
        name = codecs.lookup(said).name
    except LookupError:
        return ""
    return name if name in _CODECS or said == "utf-8-sig" else ""


def _fits(data: bytes, encoding: str) -> bool:
    try:
        data.decode(encoding)
    except UnicodeDecodeError:
        return False
    return True


def _decoded(data: bytes, encoding: str) -> str:
    try:
        if not _known(encoding):
            raise LookupError(encoding)
        return data.decode(encoding)
    except LookupError:
        raise BMLSyntaxError(f"encoding: wanted UTF-8, UTF-16 or Latin, got {quoted(encoding)}") from None
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        text = f"wanted {encoding}, got the byte 0x{data[error.start]:02X}"
        raise BMLSyntaxError(text, line=line) from None


def without_controls(text: str) -> tuple[str, str]:
    """Return a text without characters that XML cannot hold, and which these were in words, or "".

    Breaks of pages and lines become blanks.
    """
    gone: dict[str, None] = {}

    def left_out(character: str) -> str:
        gone[f"U+{ord(character):04X}"] = None
        return " " if character in "\v\f\x1c\x1d\x1e\x1f" else ""

    def referred(found: re.Match[str]) -> str:
        digits = found[0][2:-1]
        number = int(digits[1:], 16) if digits[0] in "xX" else int(digits)
        character = chr(number) if number <= 0x10FFFF else "\uffff"
        return left_out(character) if _FORBIDDEN.match(character) else found[0]

    text = _FORBIDDEN.sub(lambda found: left_out(found[0]), text)
    if "&#" in text:
        text = _REFERENCE.sub(referred, text)
    listed = ", ".join(list(gone)[:5])
    return text, f"characters that XML cannot hold are left out: {listed}" if gone else ""
