"""BML feedback: what happened in, one XML element out, and back.

`to_xml` takes `seq`, the number of the message in its session, and `epoch`, the POSIX seconds at which the
session clock was 0: with it every time of the session clock comes in POSIX milliseconds too, as BMLA has it.
Neither is part of ==.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from lxml import etree

from bml_schema.asap import FaceKeyframe
from bml_schema.behaviours import Speech, SpeechText, Sync
from bml_schema.documents import element
from bml_schema.errors import BMLError, BMLSyntaxError, shown
from bml_schema.escape import escape, escape_value, legal
from bml_schema.nodes import BMLA, CORE, OWN, Behaviour, bmla, core, own
from bml_schema.parser import read_behaviour
from bml_schema.shape import local
from bml_schema.sync_refs import SyncRef
from bml_schema.values import NUMBER, decimal
from bml_schema.vocabulary import VOCABULARY
from bml_schema.writer import Writer

__all__ = [
    "BlockPrediction",
    "BlockProgress",
    "Feedback",
    "PredictionFeedback",
    "SyncPointProgress",
    "WarningFeedback",
    "parse_feedback",
    "predicted",
]


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockProgress:
    """A block started or ended.

    Attributes:
        id: "block:start" or "block:end".
        global_time: seconds on the session clock.
        character_id: as in the block.
        status: BMLA's word for the block's state: IN_EXEC, DONE, INTERRUPTED, REVOKED; None says nothing.
        said: where speech of the block was cut off: all its words that were spoken to their end, "" for none.
        posix_time: milliseconds since 1970, as read; None where it does not say.
    """

    id: str
    global_time: float
    character_id: str | None = None
    status: str | None = None
    said: str | None = None
    seq: int | None = field(default=None, compare=False)
    posix_time: int | None = field(default=None, compare=False)

    @property
    def last_word(self) -> str | None:
        """The last word of `said`; None where there is none."""
        return self.said.split()[-1] if self.said and self.said.strip() else None

    def to_xml(self, seq: int | None = None, epoch: float | None = None) -> str:
        """The element as text; `seq` and `epoch` as the module says."""
        return _xml(
            "blockProgress",
            {"id": self.id, "globalTime": self.global_time, "characterId": self.character_id},
            seq=self.seq if seq is None else seq,
            bmla={"posixTime": _posix(self.global_time, epoch, self.posix_time), "status": self.status},
            own={"said": self.said, "lastWord": self.last_word},
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SyncPointProgress:
    """A behaviour passed a sync point.

    Attributes:
        id: "block:behaviour:sync", such as "bml1:nod1:stroke:2".
        time: seconds from block start.
        global_time: seconds on the session clock.
    """

    id: str
    time: float
    global_time: float
    character_id: str | None = None
    seq: int | None = field(default=None, compare=False)
    posix_time: int | None = field(default=None, compare=False)

    def to_xml(self, seq: int | None = None, epoch: float | None = None) -> str:
        """The element as text; `seq` and `epoch` as the module says."""
        return _xml(
            "syncPointProgress",
            {
                "id": self.id,
                "time": self.time,
                "globalTime": self.global_time,
                "characterId": self.character_id,
            },
            seq=self.seq if seq is None else seq,
            bmla={"posixTime": _posix(self.global_time, epoch, self.posix_time)},
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class WarningFeedback:
    """Something was dropped.

    Attributes:
        id: a block, "block:behaviour", or a constraint.
        type: such as PARSING_FAILURE.
        text: for people.
    """

    id: str
    type: str
    text: str = ""
    character_id: str | None = None
    seq: int | None = field(default=None, compare=False)

    def to_xml(self, seq: int | None = None, epoch: float | None = None) -> str:
        """The element as text; no CDATA and no elements inside, clients refuse both."""
        return _xml(
            "warningFeedback",
            {"id": self.id, "type": self.type, "characterId": self.character_id},
            escape(legal(self.text)),
            seq=self.seq if seq is None else seq,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class BlockPrediction:
    """When a block is expected to start and end, seconds on the session clock; None while unknown.

    Attributes:
        status: BMLA's word for its state: IN_PREP, PENDING, LURKING, IN_EXEC, SUBSIDING.
        posix_start, posix_end: milliseconds since 1970, as read; None where it does not say.
    """

    id: str
    global_start: float | None = None
    global_end: float | None = None
    status: str | None = None
    posix_start: int | None = field(default=None, compare=False)
    posix_end: int | None = field(default=None, compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class PredictionFeedback:
    """What is expected to happen.

    Attributes:
        blocks: block times.
        behaviours: nodes whose id is "block:behaviour" and whose syncs are plain numbers; see `predicted`.
    """

    character_id: str | None = None
    blocks: tuple[BlockPrediction, ...] = ()
    behaviours: tuple[Behaviour, ...] = ()
    seq: int | None = field(default=None, compare=False)

    def to_xml(self, seq: int | None = None, epoch: float | None = None) -> str:
        """The element as text; `seq` and `epoch` as the module says."""
        writer = Writer()
        inner: list[str] = []
        for block in self.blocks:
            times = {"id": block.id, "globalStart": block.global_start, "globalEnd": block.global_end}
            told = {
                "posixStartTime": _posix(block.global_start, epoch, block.posix_start),
                "posixEndTime": _posix(block.global_end, epoch, block.posix_end),
                "status": block.status,
            }
            named = {writer.name(bmla(name)): value for name, value in told.items() if value is not None}
            inner.append(f"<bml{_attributes({**times, **named})}/>")
        inner.extend(writer.behaviour(b) for b in self.behaviours)
        return _xml(
            "predictionFeedback",
            {"characterId": self.character_id},
            "\n" + "\n".join(inner) + "\n" if inner else "",
            seq=self.seq if seq is None else seq,
            declarations=writer.declarations(),
        )


Feedback = BlockProgress | SyncPointProgress | WarningFeedback | PredictionFeedback


def predicted(node: Behaviour, block: str, times: Mapping[str, float]) -> Behaviour:
    """A behaviour as predictionFeedback tells of it: id "block:behaviour", each sync point a plain number.

    Args:
        node: as parsed; its descriptions, its priority and what is others' stay out.
        block: id of its block.
        times: sync point -> seconds from block start. "stroke:n" has no attribute form and stays out.
    """
    syncs = {p: SyncRef(offset=round(times[p], 6)) for p in node.sync_points if p in times}
    node = replace(
        node, id=f"{block}:{node.id}", syncs=syncs, descriptions=(), foreign={}, others=(), priority=0.0
    )
    if isinstance(node, Speech):
        refs = {p: SyncRef(offset=round(time, 6)) for p, time in times.items() if p not in node.sync_points}
        parts = node.text.parts if node.text is not None else ()
        parts = tuple(p if isinstance(p, str) else replace(p, ref=refs.pop(p.id, None)) for p in parts)
        # Marks that only a description names stand behind the text.
        parts += tuple(Sync(id=mark, ref=ref) for mark, ref in refs.items())
        return replace(node, text=SpeechText(parts=parts) if parts else node.text)
    if isinstance(node, FaceKeyframe):
        return replace(node, interpolator=None)  # thousands of numbers that nobody reads from feedback
    return node


def parse_feedback(text: str, vocabulary: Mapping[str, type[Behaviour]] = VOCABULARY) -> Feedback:
    """The feedback an element tells of; unknown attributes and unknown children are ignored.

    Raises:
        BMLError: not well-formed, not feedback, or without an attribute it must have.
    """
    if "<!DOCTYPE" in text:
        raise BMLSyntaxError("wanted feedback without DTD and entities, got <!DOCTYPE")
    try:
        root = element(text.strip("\ufeff \t\r\n").encode())
    except UnicodeEncodeError:
        raise BMLSyntaxError("wanted characters XML can hold") from None
    kind = str(root.tag)
    who: dict[str, Any] = {"character_id": root.get("characterId"), "seq": _seq(root)}
    if kind == core("blockProgress"):
        status = root.get(bmla("status"))
        return BlockProgress(
            id=_needed(root, "id"),
            global_time=_time(root, "globalTime"),
            status=status,
            said=root.get(own("said")),
            posix_time=_milliseconds(root),
            **who,
        )
    if kind == core("syncPointProgress"):
        return SyncPointProgress(
            id=_needed(root, "id"),
            time=_time(root, "time"),
            global_time=_time(root, "globalTime"),
            posix_time=_milliseconds(root),
            **who,
        )
    if kind == core("warningFeedback"):
        said = "".join(str(t) for t in root.itertext())
        return WarningFeedback(id=_needed(root, "id"), type=_needed(root, "type"), text=said, **who)
    if kind == core("predictionFeedback"):
        blocks = tuple(_block(e) for e in root if e.tag == core("bml"))
        behaviours = (read_behaviour(e, vocabulary) for e in root if e.tag != core("bml"))
        return PredictionFeedback(
            blocks=blocks, behaviours=tuple(b for b in behaviours if b is not None), **who
        )
    raise BMLError(f"wanted BML 1.0 feedback, got <{local(kind)}>", line=_line(root))


def _block(child: etree._Element) -> BlockPrediction:
    start, end = (_time(child, n) if n in child.attrib else None for n in ("globalStart", "globalEnd"))
    return BlockPrediction(
        id=_needed(child, "id"),
        global_start=start,
        global_end=end,
        status=child.get(bmla("status")),
        posix_start=_milliseconds(child, "posixStartTime"),
        posix_end=_milliseconds(child, "posixEndTime"),
    )


def _needed(source: etree._Element, name: str) -> str:
    value = source.get(name)
    if value is None:
        raise BMLError(f"{name}: wanted one, got none", line=_line(source), path=f"/{local(str(source.tag))}")
    return str(value)


def _time(source: etree._Element, name: str) -> float:
    value = _needed(source, name).strip()
    # Java clients and servers write 1.0E-4: others' feedback may have exponents, ours never.
    if not NUMBER.fullmatch(value.partition("E")[0].partition("e")[0]):
        raise BMLError(f"{name}: wanted seconds, got {shown(value)}", line=_line(source))
    try:
        return float(value)
    except ValueError:
        raise BMLError(f"{name}: wanted seconds, got {shown(value)}", line=_line(source)) from None


def _line(source: etree._Element) -> int:
    line: Any = source.sourceline
    return int(line or 1)


def _seq(root: etree._Element) -> int | None:
    return _whole(root.get(own("seq"), ""))


def _milliseconds(source: etree._Element, name: str = "posixTime") -> int | None:
    return _whole(source.get(bmla(name), ""))


def _whole(value: str) -> int | None:
    return int(value) if value.isdecimal() and len(value) < 20 else None


def _posix(time: float | None, epoch: float | None, read: int | None) -> str | None:
    """Whole milliseconds since 1970 of a time on the session clock; without an epoch, what was read."""
    if time is None or epoch is None:
        return None if read is None else str(read)
    return str(round((epoch + time) * 1000))


def _attributes(values: Mapping[str, str | float | None]) -> str:
    out = ""
    for name, value in values.items():
        if value is not None:
            text = value if isinstance(value, str) else decimal(round(value, 6))
            out += f' {name}="{escape_value(legal(text))}"'
    return out


def _xml(
    name: str,
    values: Mapping[str, str | float | None],
    inside: str = "",
    *,
    seq: int | None,
    bmla: Mapping[str, str | None] | None = None,
    own: Mapping[str, str | None] | None = None,
    declarations: str = "",
) -> str:
    """One element in the core namespace; times to the microsecond, and never with an exponent."""
    start = f'<{name} xmlns="{CORE}"{declarations}{_attributes(values)}'
    if told := {f"bmla:{name}": value for name, value in (bmla or {}).items() if value is not None}:
        start += f' xmlns:bmla="{BMLA}"{_attributes(told)}'
    said = {**(own or {}), "seq": None if seq is None else str(seq)}
    if ours := {f"realizer:{name}": value for name, value in said.items() if value is not None}:
        declared = f'xmlns:realizer="{OWN}"'
        # A predicted behaviour of ours has declared it already.
        start += ("" if declared in declarations else f" {declared}") + _attributes(ours)
    return f"{start}>{inside}</{name}>" if inside else f"{start}/>"
