"""SmartBody's recorded lines: times of words, visemes, sound files and curves become BML that is played.

VHBuilder and NVBG write them: `<sync time>` in the text, `<file ref>` in the description of the speech, and
beside it `<lips viseme>` and `<curves>`.
"""

import re
from collections.abc import Callable, Iterator
from itertools import count
from typing import Any

from lxml import etree

from bml_schema.canonical import canonical
from bml_schema.dialects.table import Row
from bml_schema.node_schema import local
from bml_schema.nodes import BMLT, RECORDED, own
from bml_schema.reading.undeclared_prefixes import remove_element
from bml_schema.values import NUMBER, decimal

_SOUND = "audio"
FASTEST, SLOWEST = 0.05, 6.0  # s for a word of a recorded line
_CURVE_AU = re.compile(r"(?:facs_)?au_?(\d{1,3})(?:_(left|right|both))?", re.IGNORECASE)
# Parts of the name of a curve, the action units of its positive and negative values, and their degrees at 1.
# Angles turn about the axes to the left, up and forward: positive is down, to the left, and tilted right.
_TURNS = (
    ("eye", "yaw", 61, 62, 40.0),
    ("eye", "pitch", 64, 63, 25.0),
    ("", "yaw", 51, 52, 60.0),
    ("", "pitch", 54, 53, 40.0),
    ("", "roll", 56, 55, 40.0),
)
_HEAD = ("eye", "head", "neck")
_SHAPES = {"blink": "45", "squint": "7", "eyebrowraise": "1 2"}


def read_recorded_lines(root: Any, apply: Callable[[Row], None]) -> None:
    """Translate the recorded lines of a document in place; `apply` is called with what was read as what."""
    lips = [e for e in root if local(str(e.tag)) == "lips" and e.get("viseme")]
    speeches = [e for e in root if local(str(e.tag)) == "speech"]
    if lips and not speeches:
        space = "".join(str(root.tag).rpartition("}")[:2])
        speeches = [etree.SubElement(root, f"{space}speech", id="lips")]
    for n, speech in enumerate(speeches):
        _read_speech(speech, lips if n == 0 else [], apply)
    ids = (f"curve{n}" for n in count(1))
    for curves in [e for e in root if local(str(e.tag)) == "curves"]:
        for curve in curves:
            name = (curve.get("name") or "").strip()
            shown = list(_keyframes(name, (curve.text or "").split(), curve.get("num_keys", "")))
            apply(Row("SmartBody", "curve", "name", name, "bmlt:facekeyframe" if shown else "-", ""))
            for parts, keys in shown:
                frame = etree.SubElement(root, f"{{{BMLT}}}facekeyframe", id=next(ids), type="FACS")
                frame.set("start", keys[0][0])
                inside = etree.SubElement(frame, f"{{{BMLT}}}FaceInterpolator", parts=parts)
                inside.text = "\n".join(" ".join(key) for key in keys)
        remove_element(curves)


def _read_speech(speech: Any, lips: list[Any], apply: Callable[[Row], None]) -> None:
    begin = _seconds(speech.get("start")) or 0.0
    recorded = etree.Element(own("recorded"))
    timed = _timed_words(speech)
    if not _is_plausible(speech, timed):
        for mark in speech.iterfind("{*}text/{*}sync[@time]"):
            apply(Row("SmartBody", "sync", "time", mark.attrib.pop("time"), "-", ""))
        timed = []
    for mark, until, words in timed:
        etree.SubElement(recorded, own("mark"), name=mark.get("id", ""), time=mark.attrib.pop("time"))
        if words:
            start = recorded[-1].get("time", "0")
            word = etree.SubElement(recorded, own("word"), start=start, end=until or start)
            word.text = words
    if len(recorded):
        apply(Row("SmartBody", "sync", "time", "", "the times of the words", ""))
        for point in [name for name in speech.attrib if name in ("ready", "stroke", "relax", "end")]:
            apply(Row("SmartBody", "speech", point, speech.attrib.pop(point), "-", ""))
    # Fewer would be heard as fast as nobody speaks: they are not those of the whole text.
    ends = [_seconds(element.get("end")) or 0.0 for element in lips]
    spoken = lips and max(ends) - begin >= FASTEST * len(_words(speech))
    for element in lips:
        first, last = _seconds(element.get("start")), _seconds(element.get("end"))
        if spoken and first is not None and last is not None and last > first:
            times = {"start": decimal(max(first - begin, 0.0)), "end": decimal(max(last - begin, 0.0))}
            amount = element.get("articulation") or "1"
            etree.SubElement(recorded, own("viseme"), times, name=element.get("viseme"), amount=amount)
            apply(Row("SmartBody", "lips", "", "", "visemes of the speech", ""))
        else:
            apply(Row("SmartBody", "lips", "viseme", element.get("viseme"), "-", ""))
        remove_element(element)
    space = "".join(str(speech.tag).rpartition("}")[:2])
    for file in list(speech.iterfind("{*}description/{*}file")):
        description = file.getparent()
        apply(Row("SmartBody", "file", "ref", "", "the sound", ""))
        content = etree.SubElement(description, f"{{{BMLT}}}audiofile", fileName=file.get("ref") or "")
        content.tail = None
        description.set("type", _SOUND)
        remove_element(file)
    if len(recorded):
        description = etree.SubElement(speech, f"{space}description", priority="1", type=RECORDED)
        description.append(etree.fromstring(canonical(recorded)))


def _timed_words(speech: Any) -> list[tuple[Any, str, str]]:
    """Return (sync, time of the next one or "", words up to it) of each sync with a time."""
    syncs = [s for s in speech.iterfind("{*}text/{*}sync") if _seconds(s.get("time")) is not None]
    ends = [*(sync.get("time", "") for sync in syncs), ""][1:]
    return [
        (sync, until, " ".join((sync.tail or "").split())) for sync, until in zip(syncs, ends, strict=False)
    ]


def _words(speech: Any) -> list[str]:
    return [word for text in speech.iterfind("{*}text") for word in "".join(text.itertext()).split()]


def _is_plausible(speech: Any, timed: list[tuple[Any, str, str]]) -> bool:
    """Return whether times can be those of all words of a speech: else it is spoken by the voice's own."""
    times = [_seconds(sync.get("time")) or 0.0 for sync, _, _ in timed]
    words = _words(speech)
    return (
        len(timed) == len(list(speech.iterfind("{*}text/{*}sync[@time]")))
        and min(times, default=0.0) >= 0
        and times == sorted(times)
        and all(
            float(until or "-inf") > at for at, (_, until, said) in zip(times, timed, strict=True) if said
        )
        and " ".join(said for *_, said in timed if said).split() == words
        and (not timed or FASTEST * len(words) <= times[-1] - times[0] <= SLOWEST * (len(words) + 10))
    )


def _seconds(text: str | None) -> float | None:
    text = (text or "").strip()
    return float(text) if len(text) < 40 and NUMBER.fullmatch(text) else None


Keys = list[list[str]]


def _keyframes(name: str, numbers: list[str], count: str) -> Iterator[tuple[str, Keys]]:
    """Yield (parts, keys) of <FaceInterpolator> for a curve; none if it means nothing here."""
    values = [_seconds(number) for number in numbers]
    most = int(count) if count.isdecimal() else len(values) // 4
    width = len(values) // most if most and len(values) % most == 0 else 2  # time, value and perhaps slopes
    pairs = list(zip(values[::width], values[1::width], strict=False))
    if len(pairs) < 2 or any(t is None or v is None for t, v in pairs):
        return
    rising = dict(sorted((t or 0.0, v or 0.0) for t, v in pairs))
    plain = "".join(name.lower().replace("_", " ").split())
    if found := _CURVE_AU.fullmatch(name):
        side = f".{found[2].upper()}" if found[2] else ""
        yield f"{found[1]}{side}", _rows(rising, 1.0, 1)
        return
    if plain in _SHAPES:
        yield _SHAPES[plain], _rows(rising, 1.0, len(_SHAPES[plain].split()))
    elif any(part in plain for part in _HEAD):
        for part, turn, plus, minus, degrees in _TURNS:
            if part in plain and turn in plain:
                yield str(plus), _rows(rising, degrees, 1)
                yield str(minus), _rows(rising, -degrees, 1)
                return


def _rows(values: dict[float, float], whole: float, columns: int) -> Keys:
    """Return lines of keys, scaled so that `whole` is 1, and limited to 0..1."""
    scaled = {t: min(max(v / whole, 0.0), 1.0) for t, v in values.items()}
    return [[decimal(round(t, 4)), *[decimal(round(v, 4))] * columns] for t, v in scaled.items()]
