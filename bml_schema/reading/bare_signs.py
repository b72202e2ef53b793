"""Documents whose only fault is a bare "&" or "<", or an entity of HTML, in what they want spoken."""

import html
import re

_VALUE = r"""\s*=\s*(?:"[^"<]*"|'[^'<]*')"""
_TOKEN = re.compile(
    r"<!--.*?-->|<!\[CDATA\[.*?\]\]>|<\?.*?\?>"
    rf"|<(?P<end>/?)(?:[\w.-]+:)?(?P<name>[A-Za-z_][\w.-]*)(?:\s+[\w:.-]+{_VALUE})*\s*(?P<empty>/?)>"
    r"|<|&(?P<entity>#?\w{1,32};)?",
    re.DOTALL,
)
_AMPERSAND = re.compile(r"&(?P<entity>#?\w{1,32};)?")
_CLOSED = (("<!--", "-->"), ("<![CDATA[", "]]>"), ("<?", "?>"))
_XML = frozenset({"amp;", "lt;", "gt;", "quot;", "apos;"})
_TEXTS = frozenset({"text", "speak", "speech"})
_NEAR = 12  # characters on each side of a sign that its note quotes
_MOST = 3  # signs that a note quotes


def mend(document: str) -> tuple[str, str]:
    """Return a document with its bare signs escaped, and a note that shows how they were read, or "".

    A "<" is a sign where it begins no tag, inside of <text>, <speech> or <speak> only.
    """
    if any(document.rfind(begin) > document.rfind(end) for begin, end in _CLOSED):
        return document, ""  # that is another fault
    notes: list[str] = []
    depth = 0

    def ampersand(found: re.Match[str]) -> str:
        entity = found["entity"]
        if entity in _XML or (entity or "").startswith("#"):
            return found[0]
        meant = html.unescape(found[0]) if entity else "&"
        read = "" if meant == "&" or meant == found[0] else f' as "{meant}"'
        notes.append(f'"{_around(document, found)}"{read}')
        return "".join(f"&#{ord(sign)};" for sign in meant)

    def token(found: re.Match[str]) -> str:
        nonlocal depth
        if found["name"]:
            if found["name"] in _TEXTS and not found["empty"]:
                depth += -1 if found["end"] else 1
            return found[0] if "&" not in found[0] else _AMPERSAND.sub(ampersand, found[0])
        if found[0][0] == "&":
            return ampersand(found)
        if found[0] != "<" or depth <= 0:
            return found[0]
        notes.append(f'"{_around(document, found)}"')
        return "&lt;"

    mended = _TOKEN.sub(token, document)
    if not notes:
        return document, ""
    more = f" and {len(notes) - _MOST} more" if len(notes) > _MOST else ""
    return mended, f"signs that begin no markup are read as text: {', '.join(notes[:_MOST])}{more}"


def _around(document: str, found: re.Match[str]) -> str:
    before = document[max(0, found.start() - _NEAR) : found.start()].rpartition(">")[2]
    after = document[found.end() : found.end() + _NEAR].partition("<")[0]
    return " ".join(f"{before}{found[0]}{after}".split())
