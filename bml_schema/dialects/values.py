"""Values of dialects that take more than a row of the table: functions (element, value) -> attributes.

They return None to leave the value as it is.
"""

import math
from collections.abc import Callable, Mapping
from typing import Final

from lxml import etree

from bml_schema.behaviours import DIRECTIONS, STANCES
from bml_schema.values import NUMBER, decimal

Attributes = Mapping[str, str]

_JOINTS = ("EYES", "HEAD", "NECK", "CHEST", "BACK")
_OTHER_JOINTS = {
    "OPTICAL": "EYES",
    "CRANIAL": "HEAD",
    "CERVICAL": "NECK",
    "THORAX": "CHEST",
    "LUMBAR": "BACK",
}
_INFLUENCES = {"CHEST": "SHOULDER", "BACK": "WAIST"}
_ORIENTATIONS = {
    **{name: name for name in ("LEFT", "RIGHT", "UP", "DOWN")},
    **{f"{y}{x}": f"{y}_{x}" for y in ("UP", "DOWN") for x in ("LEFT", "RIGHT")},
    "ROLLLEFT": "TILT_LEFT",
    "ROLLRIGHT": "TILT_RIGHT",
}
_POLAR = ("RIGHT", "UPRIGHT", "UP", "UPLEFT", "LEFT", "DOWNLEFT", "DOWN", "DOWNRIGHT")
_LANGUAGES = {
    "english": "en",
    "french": "fr",
    "german": "de",
    "italian": "it",
    "japanese": "ja",
    "spanish": "es",
}
_SHAPES = {"eyebrow": "raise", "eyelid": "close"}
_MOST_STROKES = 100


def _number(text: str | None, default: float = 0.0) -> float:
    text = (text or "").strip()
    return float(text) if len(text) < 40 and NUMBER.fullmatch(text) else default


def _word(text: str) -> str:
    return "".join(c for c in text.upper() if c.isalpha())


def amount(element: etree._Element, value: str) -> Attributes | None:
    size = _number(value, 0.5)
    return None if 0 <= size <= 1 else {"amount": decimal(min(abs(size), 1.0))}


def repeats(element: etree._Element, value: str) -> Attributes:
    return {"repetition": str(max(1, min(_MOST_STROKES, round(_number(value, 1)))))}


def toss(element: etree._Element, value: str) -> Attributes:
    return {"lexeme": "TILT_LEFT" if _number(element.get("amount")) >= 0 else "TILT_RIGHT"}


def parameterized(element: etree._Element, value: str) -> Attributes:
    return {"lexeme": "TILT_LEFT" if _number(element.get("x")) <= 0 else "TILT_RIGHT"}


def orient(element: etree._Element, value: str) -> Attributes:
    return {"lexeme": _ORIENTATIONS.get(_word(element.get("direction") or ""), "UP")}


def direction(element: etree._Element, value: str) -> Attributes | None:
    word = _word(value)
    known = word in DIRECTIONS and not (value.upper() == word and "direction" not in element.attrib)
    return {"offsetDirection": word} if known else None


def joints(element: etree._Element, value: str) -> Attributes:
    named = [_OTHER_JOINTS.get(word, word) for word in value.upper().split()]
    found = [joint for joint in _JOINTS if joint in named]
    return {"influence": _INFLUENCES.get(found[-1], found[-1])} if found else {}


def saccade(element: etree._Element, value: str) -> Attributes:
    steps = round(_number(value) / 45) % len(_POLAR)
    size = min(_number(element.get("magnitude"), 15.0), 90.0)
    return {"offsetDirection": _POLAR[steps], "offsetAngle": decimal(math.fabs(size))}


def au(element: etree._Element, value: str) -> Attributes:
    return {"au": value.strip()[2:].strip(" _")}


def au_side(element: etree._Element, value: str) -> Attributes:
    number, _, side = value.strip().removeprefix("au_").partition("_")
    return {"au": number, "side": side.upper()}


def eyes(element: etree._Element, value: str) -> Attributes | None:
    """How eyes move from now on; a saccade with a direction is one movement, whatever its mode."""
    if not {"direction", "offsetDirection"}.isdisjoint(element.keys()):
        for name in ("mode", "finish"):
            element.attrib.pop(name, "")
        return None
    modes = {"listen": "LISTENING", "think": "THINKING"}
    return {"eyes": next((eyes for mode, eyes in modes.items() if value.lower().startswith(mode)), "WAITING")}


def part_of_face(element: etree._Element, value: str) -> Attributes:
    """The type of a <face> in drafts: without a shape, what its part does most."""
    if {"shape", "lexeme", "au"}.isdisjoint(element.keys()):
        return {"shape": next((s for part, s in _SHAPES.items() if value.lower().startswith(part)), "open")}
    return {}


def stance(element: etree._Element, value: str) -> Attributes:
    """The type of a <posture> in drafts: a stance of the body, or the pose of a part of it."""
    space = "".join(str(element.tag).rpartition("}")[:2])
    if _word(value) in STANCES:
        etree.SubElement(element, f"{space}stance", type=_word(value))
    lexeme = element.get("lexeme") or ("" if _word(value) in STANCES else value)
    if lexeme:
        part = (element.get("part") or "WHOLEBODY").upper()
        etree.SubElement(element, f"{space}pose", part=part, lexeme=lexeme.upper())
    return {}


def language_tag(name: str) -> str:
    """Return the BCP-47 tag of a language, or ""."""
    name = name.strip()
    head, *_ = name.split("-")
    return _LANGUAGES.get(name.lower(), name if head.isalpha() and len(head) in (2, 3) else "")


FUNCTIONS: Final[Mapping[str, Callable[[etree._Element, str], Attributes | None]]] = {
    f.__name__: f
    for f in (
        amount,
        repeats,
        toss,
        parameterized,
        orient,
        direction,
        joints,
        saccade,
        au,
        au_side,
        eyes,
        part_of_face,
        stance,
    )
}
