"""The VHMSG format: vrSpeak to documents, feedback to vrAgentBML."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import dataclass, field
from urllib.parse import quote, unquote_plus
from xml.sax.saxutils import quoteattr, unescape

from bml_schema import BlockProgress, PredictionFeedback, WarningFeedback, parse_feedback
from realizer.core.settings import raises
from realizer.server.transports.document_framing import DocumentFramer
from realizer.server.transports.message_format import Action, Disconnect, Inbound, Message

# What we are called where components of a VHMSG system say who they are.
COMPONENT = "renderer"
NAME = "bml-realizer"


@dataclass(eq=False)
class _Speak:
    """A vrSpeak that is not over: whom it is for, and what has become of its blocks."""

    agent: str
    recipient: str
    id: str
    blocks: set[str]
    planned: set[str] = field(default_factory=set)
    started: bool = False
    interrupted: bool = False
    error: str = ""
    plays: bool = False  # a behaviour of it
    dropped: str = ""  # why the first behaviour that went did

    def says(self, verb: str, rest: str = "") -> str:
        return f"{verb} {self.agent} {self.recipient} {self.id} {rest}".rstrip()


class Vhmsg:
    """VHMSG, what SmartBody and the Virtual Human Toolkit talk: vrSpeak in, vrAgentBML and vrSpoke out.

    A vrSpeak's documents become blocks of the agent it names; one without an id gets the message's. All
    components share one topic, so most of what comes in is not for us, and we hear ourselves.
    """

    def __init__(self, topic: str, limit: int) -> None:
        self.topic = topic
        self._limit = limit
        self._speaks: dict[str, _Speak] = {}  # by block

    def hello(self) -> list[Message]:
        return [self._message(f"vrComponent {COMPONENT} {NAME}")]

    def incoming(self, body: bytes) -> list[Action]:
        text = body.decode("utf-8", "replace")
        # Clients encode the whole; one that does not cannot avoid a blank.
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
        # The XML is an <act> with a <bml> in it, or a <bml> alone: what is around it is for others.
        found = DocumentFramer(self._limit).feed(xml.encode("utf-8", "replace") + b"\n")
        documents = [text for text in found if isinstance(text, str)]
        speak = _Speak(agent, recipient, id, set())
        if not documents:
            faults = [
                f"{fault.text} {raises('max_document')}" if fault.large else fault.text
                for fault in found
                if not isinstance(fault, str) and "<bml" not in fault.text
            ]
            speak.error = faults[0] if faults else "wanted a whole <bml> document"
            return list(self._finish(speak))
        actions: list[Action] = []
        for document in documents:
            block, text = _named(document, self._free, id, agent)
            speak.blocks.add(block)
            self._speaks[block] = speak
            actions.append(Inbound(text))
        return actions

    def _free(self, id: str) -> bool:
        return id not in self._speaks

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
                    return [self._message(speak.says("vrAgentBML", "start"))]
            case WarningFeedback(id=id, text=text) if id in self._speaks:
                # A warning on the block itself refuses it, unless its prediction is already out.
                speak = self._speaks[id]
                if id not in speak.planned:
                    speak.error = text
                    return self._ended(speak, id)
            case PredictionFeedback(blocks=blocks, behaviours=behaviours):
                for told in blocks:
                    if told.global_end is not None and told.id in self._speaks:
                        self._speaks[told.id].planned.add(told.id)
                        self._speaks[told.id].plays |= bool(behaviours)
            case WarningFeedback(id=id, text=text) if speak := self._speaks.get(id.partition(":")[0]):
                speak.dropped = speak.dropped or text
        return []

    def _ended(self, speak: _Speak, block: str) -> list[Message]:
        del self._speaks[block]
        speak.blocks.discard(block)
        return [] if speak.blocks else self._finish(speak)

    def _finish(self, speak: _Speak) -> list[Message]:
        """Its last block has ended, or it never had one. Where nothing of it played, that is an error."""
        if not speak.plays and not speak.interrupted:
            speak.error = speak.error or speak.dropped
        if speak.error:
            said = " ".join(speak.error.split())
            return [
                self._message(speak.says("vrAgentBML", f"end error {said}")),
                self._message(speak.says("vrSpeakFailed", said)),
            ]
        if speak.interrupted:
            return [self._message(speak.says("vrAgentBML", "end interrupted"))]
        return [
            self._message(speak.says("vrAgentBML", "end complete")),
            self._message(speak.says("vrSpoke")),
        ]

    def farewell(self) -> list[Message]:
        speaks = dict.fromkeys(self._speaks.values())
        self._speaks.clear()
        return [self._message(speak.says("vrAgentBML", "end interrupted")) for speak in speaks]

    def _message(self, text: str) -> Message:
        scope = self.topic.rpartition("/")[2]
        headers = {"ELVISH_SCOPE": scope, "MESSAGE_PREFIX": text.partition(" ")[0]}
        return Message(self.topic, quote(text, safe=""), headers)


_START = re.compile(r"""<(?:[\w.-]+:)?bml(?=[\s/>])(?:[^<>"']|"[^<"]*"|'[^<']*')*""")
_ID = re.compile(r"""\sid\s*=\s*(?:"([^"]*)"|'([^']*)')""")
_CHARACTER = re.compile(r"\scharacterId\s*=")
_NAME = re.compile(r"[^\w.-]")


def _named(document: str, free: Callable[[str], bool], id: str, agent: str) -> tuple[str, str]:
    """The block id of a document, and the document with that id and a character.

    Its own id where it has one that is free; otherwise the message's, as a block id may be written.
    """
    found = _START.match(document)
    assert found is not None  # the assembler found it by the same mark
    tag, rest = found[0], document[found.end() :]
    slash = "/" if tag.endswith("/") else ""
    tag = tag.removesuffix("/").rstrip()
    named = _ID.search(tag)
    own = unescape((named[1] or named[2] or "") if named else "").strip()
    block = own
    if not own or not free(own):
        base = _NAME.sub("_", id)
        block, n = base, 1
        while not free(block):
            n += 1
            block = f"{base}-{n}"
        tag = f'{tag[: named.start()] + tag[named.end() :] if named else tag} id="{block}"'
    if not _CHARACTER.search(tag):
        tag += f" characterId={quoteattr(agent)}"
    return block, tag + slash + rest
