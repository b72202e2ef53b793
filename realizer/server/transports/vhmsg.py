"""The VHMSG message format: documents in vrSpeak, feedback as vrAgentBML."""

import json
import re
from collections.abc import Container
from dataclasses import dataclass, field
from urllib.parse import quote, unquote_plus
from xml.sax.saxutils import quoteattr, unescape

from bml_schema import BlockProgress, PredictionFeedback, WarningFeedback, parse_feedback
from bml_schema.errors import NOT_BML_1_0
from realizer.server.transports.document_framing import DocumentFramer
from realizer.server.transports.message_formats import Action, Disconnect, Inbound, Message, MessageFormat

# The names by which components of a VHMSG system know the realizer.
COMPONENT = "renderer"
NAME = "bml-realizer"


@dataclass(eq=False)
class _Speak:
    """A vrSpeak that has not ended, with the ids of its blocks: all that play or wait, and those planned.

    `unread` are those without any feedback. `dropped` says why the first dropped behaviour was dropped,
    `dialect` how a document that is not BML 1.0 was read, or that it was not.
    """

    agent: str
    recipient: str
    id: str
    blocks: set[str]
    planned: set[str] = field(default_factory=set)
    unread: set[str] = field(default_factory=set)
    started: bool = False
    interrupted: bool = False
    error: str = ""
    plays: bool = False
    dropped: str = ""
    dialect: str = ""

    def message(self, verb: str, rest: str = "") -> str:
        return f"{verb} {self.agent} {self.recipient} {self.id} {rest}".rstrip()


class Vhmsg(MessageFormat):
    """The format of SmartBody and the Virtual Human Toolkit.

    It reads vrSpeak, and writes vrAgentBML and vrSpoke. The documents of a vrSpeak become blocks of the agent
    it names; one without an id gets the message's id.
    All components share one topic, so most messages are for others, and some are our own.
    """

    def __init__(self, topic: str, limit: int) -> None:
        self.topic = topic
        self._limit = limit
        self._speaks: dict[str, _Speak] = {}  # by block

    def hello(self) -> list[Message]:
        return [self._message(f"vrComponent {COMPONENT} {NAME}")]

    def incoming(self, body: bytes) -> list[Action]:
        text = body.decode("utf-8", "replace")
        # Encoded messages contain no blank; some clients do not encode.
        words = (text if " " in text else unquote_plus(text)).split(maxsplit=4)
        match words:
            case ["vrSpeak", agent, recipient, id, xml]:
                return self._speak(agent, recipient, id, xml)
            case ["vrSpeak", agent, recipient, id]:
                return self._speak(agent, recipient, id, "")
            case ["vrSpoke", agent, _, id, *_]:
                return self._stop(agent, id)
            case ["vrAllCall", *_]:
                return list(self.hello())
            case ["vrKillComponent", who, *_] if who.lower() in (COMPONENT, NAME, "all"):
                return [Disconnect()]
        return []

    def _speak(self, agent: str, recipient: str, id: str, xml: str) -> list[Action]:
        # The XML is an <act> that contains a <bml>, or only a <bml>.
        items = DocumentFramer(self._limit).feed(xml.encode("utf-8", "replace") + b"\n")
        documents = [item for item in items if isinstance(item, str)]
        speak = _Speak(agent, recipient, id, set())
        if not documents:
            faults = [item.text for item in items if not isinstance(item, str) and "<bml" not in item.text]
            speak.error = faults[0] if faults else "wanted a whole <bml> document"
            return list(self._finish(speak))
        actions: list[Action] = []
        for document in documents:
            block, text = _named(document, self._speaks, id, agent)
            speak.blocks.add(block)
            speak.unread.add(block)
            self._speaks[block] = speak
            actions.append(Inbound(f"<act>{text}</act>"))  # so that it is read as SmartBody's BML
        return actions

    def _stop(self, agent: str, id: str) -> list[Action]:
        blocks = [b for b, speak in self._speaks.items() if (speak.agent, speak.id) == (agent, id)]
        return [Inbound(json.dumps({"type": "stop", "blocks": blocks}))] if blocks else []

    def outgoing(self, feedback: str) -> list[Message]:
        if not self._speaks:
            return []
        match parse_feedback(feedback):
            case BlockProgress(id=id, status=status):
                block, _, point = id.rpartition(":")
                speak = self._speaks.get(block)
                if speak is None:
                    return []
                if point == "end":
                    speak.interrupted |= status in ("INTERRUPTED", "REVOKED")
                    return self._ended(speak, block)
                if not speak.started:
                    speak.started = True
                    return [self._message(speak.message("vrAgentBML", "start"))]
            case WarningFeedback(id=id, type=type, text=text) if id in self._speaks:
                # A warning on the block itself refuses it, unless its prediction is already out.
                speak = self._speaks[id]
                if id not in speak.planned:
                    speak.error = text
                    return self._ended(speak, id)
                speak.dialect = speak.dialect or (text if type == NOT_BML_1_0 else "")
            case WarningFeedback(id="<no id>", text=text):
                # Documents are read in order: this one has an id that cannot be used.
                for block, speak in self._speaks.items():
                    if block in speak.unread:
                        speak.error = text
                        return self._ended(speak, block)
            case PredictionFeedback(blocks=blocks, behaviours=behaviours):
                for b in blocks:
                    if (known := self._speaks.get(b.id)) is not None:
                        known.unread.discard(b.id)
                    if b.status != "IN_PREP" and known is not None:
                        known.planned.add(b.id)
                        known.plays |= bool(behaviours)
            case WarningFeedback(id=id, text=text) if speak := self._speaks.get(id.partition(":")[0]):
                speak.dropped = speak.dropped or text
        return []

    def _ended(self, speak: _Speak, block: str) -> list[Message]:
        del self._speaks[block]
        speak.blocks.discard(block)
        speak.unread.discard(block)
        return [] if speak.blocks else self._finish(speak)

    def _finish(self, speak: _Speak) -> list[Message]:
        """Return the messages at the end of a vrSpeak; an error if nothing of it has played."""
        if not speak.plays and not speak.interrupted:
            reasons = (speak.dropped, speak.dialect) if speak.dropped else ()
            speak.error = speak.error or "; ".join(filter(None, reasons))
        if speak.error:
            error = " ".join(speak.error.split())
            ends = [("vrAgentBML", f"end error {error}"), ("vrSpeakFailed", error)]
        elif speak.interrupted:
            ends = [("vrAgentBML", "end interrupted")]
        else:
            ends = [("vrAgentBML", "end complete"), ("vrSpoke", "")]
        return [self._message(speak.message(verb, rest)) for verb, rest in ends]

    def farewell(self) -> list[Message]:
        speaks = dict.fromkeys(self._speaks.values())
        self._speaks.clear()
        return [self._message(speak.message("vrAgentBML", "end interrupted")) for speak in speaks]

    def _message(self, text: str) -> Message:
        scope = self.topic.rpartition("/")[2]
        headers = {"ELVISH_SCOPE": scope, "MESSAGE_PREFIX": text.partition(" ")[0]}
        return Message(self.topic, quote(text, safe=""), headers)


_START = re.compile(r"""<(?:[\w.-]+:)?bml(?=[\s/>])(?:[^<>"']|"[^<"]*"|'[^<']*')*""")
_ID = re.compile(r"""\sid\s*=\s*(?:"([^"]*)"|'([^']*)')""")
_CHARACTER = re.compile(r"\scharacterId\s*=")
_NAME = re.compile(r"[^\w.-]")


def _named(document: str, used: Container[str], id: str, agent: str) -> tuple[str, str]:
    """Return the block id of a document, and the document with that id and a character.

    The id is the document's own if it has one that is not used, or else derived from the message's.
    """
    start = _START.match(document)
    assert start is not None  # the framer found it by the same mark
    tag, rest = start[0], document[start.end() :]
    slash = "/" if tag.endswith("/") else ""
    tag = tag.removesuffix("/").rstrip()
    attribute = _ID.search(tag)
    block = unescape((attribute[1] or attribute[2] or "") if attribute else "").strip()
    if not block or block in used:
        base = _NAME.sub("_", id)
        block, n = base, 1
        while block in used:
            n += 1
            block = f"{base}-{n}"
        tag = f'{tag[: attribute.start()] + tag[attribute.end() :] if attribute else tag} id="{block}"'
    if not _CHARACTER.search(tag):
        tag += f" characterId={quoteattr(agent)}"
    return block, tag + slash + rest
