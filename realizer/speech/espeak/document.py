"""A writer of SSML for espeak-ng, with the places of words and marks in it."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

import numpy as np

from realizer.speech.ssml import Break, Mark, Part, Script, Tag, write_tag
from realizer.speech.ssml_prosody import PLAIN
from realizer.speech.words import PlacedMark, words_in

# Octaves for each doubling of espeak-ng's pitch setting, as measured in its sound from 50 % to 200 %.
OCTAVES = 0.72
MAX_PITCH = 198.0  # %; the greatest setting
STOPS = re.compile(r"\.+(?!\w)")
# Behind a quote, a bracket or a sign it would say "dot".
CLOSING = " \"'”’»)]"
STOP_BEHIND = re.compile(r"([\s\"'”’»)\]]+|[^\w\s.,;:!?…])(\.+)(?!\w)")


@dataclass(frozen=True, slots=True)
class Document:
    """The input of espeak-ng."""

    text: str  # SSML; marks are named m0, m1, ..
    # (word, place) with places as espeak-ng counts them: characters of `text` from 1
    words: tuple[tuple[str, int], ...]
    marks: tuple[PlacedMark, ...]  # in the order of the text


def write_document(script: Script) -> Document:
    text = "<speak>"
    words: list[tuple[str, int]] = []
    marks: list[PlacedMark] = []
    for part in _stops_first(script.parts):
        if isinstance(part, str):
            part = STOP_BEHIND.sub(_stop_first, part)
            words += [(word, len(text) + len(escape(part[:at])) + 1) for word, at in words_in(part)]
            text += escape(part)
        elif isinstance(part, Mark):
            text += f'<mark name="m{len(marks)}"/>'
            marks.append(PlacedMark(part.name, len(words), False))
        elif isinstance(part, Break):
            text += f'<break time="{round(part.seconds * 1000)}ms"/>'
            marks = [PlacedMark(m.name, m.word, m.paused or m.word == len(words)) for m in marks]
        else:
            text += write_tag(_in_its_units(part))
    return Document(text + "</speak>", tuple(words), tuple(marks))


def _stops_first(parts: Sequence[Part]) -> list[Part]:
    """Return the parts with full stops after a mark moved before it, where espeak-ng would say "dot"."""
    moved: list[Part] = []
    for part in parts:
        stops = STOPS.match(part) if isinstance(part, str) else None
        at = len(moved)
        while at and isinstance(moved[at - 1], Mark):
            at -= 1
        before = moved[at - 1] if at else None
        if stops is None or at == len(moved) or not isinstance(before, str) or before[-1].isspace():
            moved.append(part)
            continue
        moved[at - 1] = before + stops[0]
        if rest := str(part)[stops.end() :]:
            moved.append(rest)
    return moved


def _stop_first(found: re.Match[str]) -> str:
    """Return a full stop before quotes and brackets; behind another sign, a comma. The length is kept."""
    if found[1][0] in CLOSING:
        return found[2] + found[1]
    return found[1] + "," * len(found[2])


def _in_its_units(tag: Tag) -> Tag:
    """Return the tag with volume and pitch of <prosody> in espeak-ng's units, and <voice> for <lang>.

    It reads decibels and semitones as per cent, its pitch is a setting, not a factor, and it ignores <lang>.
    """
    if tag.name == "lang":
        return Tag("voice", tag.attributes)
    if tag.name != "prosody" or tag.attributes is None:
        return tag
    values = dict(tag.attributes)
    manner = PLAIN.within(values)
    if "volume" in values:
        values["volume"] = f"{100 * manner.volume:.1f}%"
    if manner.pitch != PLAIN.pitch:  # values in Hz are passed on unchanged
        values["pitch"] = f"{min(MAX_PITCH, max(0.0, 100 + 100 * np.log2(manner.pitch) / OCTAVES)):.1f}%"
    return Tag(tag.name, tuple(values.items()))
