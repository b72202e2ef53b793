"""BML feedback messages: classes, writer and parser.

`to_xml` takes `seq`, the number of the message in its session, and `epoch`, the POSIX seconds at which the
session clock was 0; with `epoch` every time of the session clock is also written in POSIX milliseconds, as
BMLA does. Neither is part of ==.
"""

from collections.abc import Mapping
from dataclasses import field, replace
from typing import Any

from lxml import etree

from bml_schema.behaviours import Speech, SpeechText, Sync
from bml_schema.bmla import FaceKeyframe
from bml_schema.documents import element
from bml_schema.errors import BMLError, BMLSyntaxError, quoted
from bml_schema.escape import escape, sanitized, sanitized_value
from bml_schema.node_schema import local, node
from bml_schema.nodes import BMLA, CORE, OWN, Behaviour, bmla, core, own
from bml_schema.reading.parser import read_behaviour
from bml_schema.sync_refs import SyncRef
from bml_schema.values import NUMBER, decimal
from bml_schema.vocabulary import VOCABULARY
from bml_schema.writer import Writer


@node
class BlockProgress:
    """A block started or ended."""

    id: str  # "block:start" or "block:end"
    global_time: float  # seconds on the session clock
    character_id: str | None = None  # as in the block
    status: str | None = None  # BMLA's state of the block: IN_EXEC, DONE, INTERRUPTED, REVOKED; or None
    # If speech of the block was cut off, the words that were spoken completely; "" for none.
    said: str | None = None
    # False if something was asked for, and nothing of the block was heard or moved the face.
    shown: bool = True
    seq: int | None = field(default=None, compare=False)
    posix_time: int | None = field(default=None, compare=False)  # milliseconds since 1970, as read, or None

    @property
    def last_word(self) -> str | None:
        """The last word of `said`, or None."""
        return self.said.split()[-1] if self.said and self.said.strip() else None

    def to_xml(self, seq: int | None = None, epoch: float | None = None) -> str:
        """Return the element as XML text; for `seq` and `epoch` see the module."""
        posix = _posix("bmla:posixTime", self.global_time, epoch, self.posix_time)
        said = _optional("realizer:said", self.said) + _optional("realizer:lastWord", self.last_word)
        said += "" if self.shown else ' realizer:shown="false"'
        return (
            f'<blockProgress{_CORE} id="{sanitized_value(self.id)}" globalTime="{_seconds(self.global_time)}"'
            f"{_optional('characterId', self.character_id)}"
            f"{_with_bmla(posix + _optional('bmla:status', self.status))}"
            f"{_with_own(said + _seq(seq, self.seq))}/>"
        )


@node
class SyncPointProgress:
    """A behaviour passed a sync point."""

    id: str  # "block:behaviour:sync", such as "bml1:nod1:stroke:2"
    time: float  # seconds from block start
    global_time: float  # seconds on the session clock
    character_id: str | None = None
    seq: int | None = field(default=None, compare=False)
    posix_time: int | None = field(default=None, compare=False)

    def to_xml(self, seq: int | None = None, epoch: float | None = None) -> str:
        """Return the element as XML text; for `seq` and `epoch` see the module."""
        return (
            f'<syncPointProgress{_CORE} id="{sanitized_value(self.id)}" time="{_seconds(self.time)}"'
            f' globalTime="{_seconds(self.global_time)}"{_optional("characterId", self.character_id)}'
            f"{_with_bmla(_posix('bmla:posixTime', self.global_time, epoch, self.posix_time))}"
            f"{_with_own(_seq(seq, self.seq))}/>"
        )


@node
class WarningFeedback:
    """A part of a document was dropped."""

    id: str  # a block, "block:behaviour", or a constraint
    type: str  # such as PARSING_FAILURE
    text: str = ""  # explanation for people
    character_id: str | None = None
    # Number of the connection whose block is refused because its id is in use; None for all other warnings.
    in_use_for: int | None = None
    seq: int | None = field(default=None, compare=False)

    def to_xml(self, seq: int | None = None, epoch: float | None = None) -> str:
        """Return the element as XML text, without CDATA and child elements, which some clients refuse."""
        start = (
            f'<warningFeedback{_CORE} id="{sanitized_value(self.id)}" type="{sanitized_value(self.type)}"'
            f"{_optional('characterId', self.character_id)}"
            f"{_with_own(_number('inUseFor', self.in_use_for) + _seq(seq, self.seq))}"
        )
        return f"{start}>{escape(sanitized(self.text))}</warningFeedback>" if self.text else f"{start}/>"


@node
class BlockPrediction:
    """The expected start and end of a block, seconds on the session clock; None while unknown."""

    id: str
    global_start: float | None = None
    global_end: float | None = None
    status: str | None = None  # BMLA's state of the block: IN_PREP, PENDING, LURKING, IN_EXEC, SUBSIDING
    posix_start: int | None = field(default=None, compare=False)  # milliseconds since 1970, as read, or None
    posix_end: int | None = field(default=None, compare=False)  # milliseconds since 1970, as read, or None


@node
class PredictionFeedback:
    """The expected times of blocks and behaviours."""

    character_id: str | None = None
    blocks: tuple[BlockPrediction, ...] = ()  # block times
    # Nodes whose id is "block:behaviour" and whose syncs are plain numbers; see `prediction_of`.
    behaviours: tuple[Behaviour, ...] = ()
    seq: int | None = field(default=None, compare=False)

    def to_xml(self, seq: int | None = None, epoch: float | None = None) -> str:
        """Return the element as XML text; for `seq` and `epoch` see the module."""
        writer = Writer()
        inner: list[str] = []
        for block in self.blocks:
            start, end = block.global_start, block.global_end
            posix = (
                _posix("bmla:posixStartTime", start, epoch, block.posix_start)
                + _posix("bmla:posixEndTime", end, epoch, block.posix_end)
                + _optional("bmla:status", block.status)
            )
            if posix:
                writer.prefixes[BMLA] = "bmla"
            times = "" if start is None else f' globalStart="{_seconds(start)}"'
            if end is not None:
                times += f' globalEnd="{_seconds(end)}"'
            inner.append(f'<bml id="{sanitized_value(block.id)}"{times}{posix}/>')
        inner.extend(writer.behaviour(b) for b in self.behaviours)
        declared = writer.declarations()
        tag = (
            f"<predictionFeedback{_CORE}{declared}{_optional('characterId', self.character_id)}"
            f"{_with_own(_seq(seq, self.seq), declared)}"
        )
        return "\n".join((f"{tag}>", *inner, "</predictionFeedback>")) if inner else f"{tag}/>"


Feedback = BlockProgress | SyncPointProgress | WarningFeedback | PredictionFeedback


def prediction_of(node: Behaviour, block: str, times: Mapping[str, float], late: float = 0.0) -> Behaviour:
    """Return a behaviour for predictionFeedback: its id is "block:behaviour", each sync point a plain number.

    Args:
        node: as parsed; descriptions, priority and unknown attributes and children are left out.
        block: id of its block.
        times: sync point -> seconds from block start. "stroke:n" has no attribute form and is left out.
        late: seconds by which it is later than its references into other blocks say; the attribute
            `realizer:late`.
    """
    syncs = {p: SyncRef(offset=round(times[p], 6)) for p in node.sync_points if p in times}
    id = f"{block}:{node.id}"
    node = replace(
        node,
        id=id,
        syncs=syncs,
        descriptions=(),
        unknown_attributes={f"{{{OWN}}}late": f"{late:.3g}"} if late else {},
        unknown_children=(),
        priority=0.0,
    )
    if isinstance(node, Speech):
        refs = {p: SyncRef(offset=round(time, 6)) for p, time in times.items() if p not in node.sync_points}
        node = node.with_references(lambda sync: refs.pop(sync.id, None))
        # Marks that only a description names follow the text.
        others = (Sync(id=mark, ref=ref) for mark, ref in refs.items())
        parts = (*(node.text.parts if node.text is not None else ()), *others)
        return replace(node, text=SpeechText(parts=parts) if parts else node.text)
    if isinstance(node, FaceKeyframe):
        return replace(node, interpolator=None)  # thousands of numbers that no client needs in feedback
    return node


def parse_feedback(text: str, vocabulary: Mapping[str, type[Behaviour]] = VOCABULARY) -> Feedback:
    """Parse a feedback element; unknown attributes and children are ignored.

    Raises:
        BMLError: not well-formed, not feedback, or without a required attribute.
        TypeError: `text` is no string.
    """
    if not isinstance(text, str):
        raise TypeError(f"text: wanted a string, got {type(text).__name__}")
    if "<!DOCTYPE" in text:
        raise BMLSyntaxError("wanted feedback without DTD and entities, got <!DOCTYPE")
    try:
        root = element(text.strip("\ufeff \t\r\n").encode())
    except UnicodeEncodeError:
        raise BMLSyntaxError("wanted characters XML can hold") from None
    kind = str(root.tag)
    seq = _whole(root.get(own("seq"), ""))
    common: dict[str, Any] = {"character_id": root.get("characterId"), "seq": seq}
    if kind == core("blockProgress"):
        return BlockProgress(
            id=_required(root, "id"),
            global_time=_time(root, "globalTime"),
            status=root.get(bmla("status")),
            said=root.get(own("said")),
            shown=root.get(own("shown")) != "false",
            posix_time=_milliseconds(root),
            **common,
        )
    if kind == core("syncPointProgress"):
        return SyncPointProgress(
            id=_required(root, "id"),
            time=_time(root, "time"),
            global_time=_time(root, "globalTime"),
            posix_time=_milliseconds(root),
            **common,
        )
    if kind == core("warningFeedback"):
        text = "".join(str(t) for t in root.itertext())
        return WarningFeedback(
            id=_required(root, "id"),
            type=_required(root, "type"),
            text=text,
            in_use_for=_whole(root.get(own("inUseFor"), "")),
            **common,
        )
    if kind == core("predictionFeedback"):
        blocks = tuple(_block(e) for e in root if e.tag == core("bml"))
        behaviours = (read_behaviour(e, vocabulary) for e in root if e.tag != core("bml"))
        return PredictionFeedback(
            blocks=blocks, behaviours=tuple(b for b in behaviours if b is not None), **common
        )
    raise BMLError(f"wanted BML 1.0 feedback, got <{local(kind)}>", line=_line(root))


def _block(child: etree._Element) -> BlockPrediction:
    start, end = (_time(child, n) if n in child.attrib else None for n in ("globalStart", "globalEnd"))
    return BlockPrediction(
        id=_required(child, "id"),
        global_start=start,
        global_end=end,
        status=child.get(bmla("status")),
        posix_start=_milliseconds(child, "posixStartTime"),
        posix_end=_milliseconds(child, "posixEndTime"),
    )


def _required(source: etree._Element, name: str) -> str:
    value = source.get(name)
    if value is None:
        raise BMLError(f"{name}: wanted one, got none", line=_line(source), path=f"/{local(str(source.tag))}")
    return str(value)


def _time(source: etree._Element, name: str) -> float:
    value = _required(source, name).strip()
    # Java programs write 1.0E-4: feedback of other realizers may have exponents, ours never has.
    if not NUMBER.fullmatch(value.partition("E")[0].partition("e")[0]):
        raise BMLError(f"{name}: wanted seconds, got {quoted(value)}", line=_line(source))
    try:
        return float(value)
    except ValueError:
        raise BMLError(f"{name}: wanted seconds, got {quoted(value)}", line=_line(source)) from None


def _line(source: etree._Element) -> int:
    line: Any = source.sourceline
    return int(line or 1)


def _milliseconds(source: etree._Element, name: str = "posixTime") -> int | None:
    return _whole(source.get(bmla(name), ""))


def _whole(value: str) -> int | None:
    return int(value) if value.isdecimal() and len(value) < 20 else None


# s; up to here a double resolves microseconds.
_EXACT = 1e9
_CORE = f' xmlns="{CORE}"'
_OWN = f' xmlns:realizer="{OWN}"'


def _seconds(time: float) -> str:
    """Format a time to the microsecond, never with an exponent."""
    if -_EXACT < time < _EXACT:
        return f"{time:.6f}".rstrip("0").rstrip(".")
    return decimal(round(time, 6))


def _optional(name: str, value: str | None) -> str:
    """Return an attribute, or "" for None."""
    return "" if value is None else f' {name}="{sanitized_value(value)}"'


def _posix(name: str, time: float | None, epoch: float | None, read: int | None) -> str:
    """Return an attribute of whole milliseconds since 1970; without an epoch, of the value that was read."""
    if time is not None and epoch is not None:
        read = round((epoch + time) * 1000)
    return "" if read is None else f' {name}="{read}"'


def _seq(seq: int | None, read: int | None) -> str:
    """Return the attribute of a number in the session; without one, of that which was read."""
    return _number("seq", read if seq is None else seq)


def _number(name: str, value: int | None) -> str:
    """Return an own attribute, or "" for None."""
    return "" if value is None else f' realizer:{name}="{value}"'


def _with_bmla(attributes: str) -> str:
    """Return attributes of BMLA with the declaration of its namespace."""
    return f' xmlns:bmla="{BMLA}"{attributes}' if attributes else ""


def _with_own(attributes: str, declared: str = "") -> str:
    """Return attributes of our namespace with its declaration, unless `declared` has it already."""
    return attributes if not attributes or _OWN in declared else _OWN + attributes
