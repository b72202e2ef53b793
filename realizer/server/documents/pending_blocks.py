"""Blocks that wait for their speech or for other blocks, and the requests to voices.

Long texts are requested in parts.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

from bml_schema import Block, ParameterValueChange
from realizer.core import work
from realizer.core.errors import RealizerError, VoiceError
from realizer.playback.block_manager import BlockManager
from realizer.playback.references import references, speaks_after
from realizer.scheduling.timing import Warning
from realizer.server.session.effects import Speak
from realizer.server.speech.long_text import LongText, spoken_length, trim_final_pause
from realizer.speech.duration_fit import allow_small_warp, silent_fallback
from realizer.speech.utterance import SpeechRequest, Utterance

# Longer texts are synthesized in parts: espeak needs 15 ms for so many spoken characters.
SHORT = 160
# The silent voice replaces one that has not answered by then.
PATIENCE = 20.0  # s
# A part of a long text that comes too late begins so much after the present.
SOON = 0.05  # s


@dataclass(eq=False)
class PendingBlock:
    """A block in preparation.

    Attributes:
        resources_of: block -> what it needs that one behaviour at a time can have ("voice", "gaze").
        is_incomplete: whether a block refers to a sync point that has not arrived.
    """

    block: Block
    character: int
    waiting_since: float
    message: int = 0  # number of the message that it came with; 0 for a part of a streamed speech
    resources_of: Callable[[Block], frozenset[str]] = lambda block: frozenset()
    requests: set[int] = field(default_factory=set)  # ids of requests without an answer
    utterances: dict[str, Utterance] = field(default_factory=dict)
    predecessors: set[PendingBlock] = field(default_factory=set)  # that must be planned first
    final: bool = False  # whether the requested speech is used as it comes, without another request
    is_incomplete: Callable[[Block], bool] = lambda block: False
    is_streaming: bool = False  # whether the block speaks part of a sentence, which another block continues
    sender: int | None = None  # number of the connection that it came by

    @cached_property
    def resources(self) -> frozenset[str]:
        """What it needs; asked only while several blocks of a character are pending."""
        return self.resources_of(self.block)

    @cached_property
    def named(self) -> frozenset[str | None]:
        """The ids of the blocks whose sync points, ends or parameters it names."""
        block, refs = self.block, (ref.block for ref in references(self.block))
        changes = (n.target[0] for n in block.behaviours if isinstance(n, ParameterValueChange))
        return frozenset((*refs, *changes, *block.append_after, *block.chunk_after, *speaks_after(block)))

    def precedes(self, id: str) -> bool:
        """Return whether it names a block in any way, which must not be there when this one is planned."""
        block = self.block
        return id in self.named or id in (*block.prepend_before, *block.chunk_before, *block.interrupt)

    @property
    def all_predecessors(self) -> set[PendingBlock]:
        """The blocks that it waits for, directly or because others wait for them."""
        found, todo = set[PendingBlock](), [self]
        while todo:
            more = todo.pop().predecessors - found
            found |= more
            todo += more
        return found

    @property
    def is_ready(self) -> bool:
        """Whether the block waits for nothing."""
        return not self.requests and not self.predecessors and not self.is_incomplete(self.block)

    def add_utterance(self, id: int, behaviour: str, utterance: Utterance) -> None:
        """Store the answer to a request."""
        self.requests.discard(id)
        self.utterances[behaviour] = allow_small_warp(utterance) if self.final else utterance


class PendingBlocks:
    """The waiting blocks in order of arrival."""

    def __init__(self) -> None:
        self.blocks: list[PendingBlock] = []

    def __len__(self) -> int:
        return len(self.blocks)

    def add(self, pending: PendingBlock) -> None:
        """Add a block, which waits for its speech and for the earlier blocks it depends on.

        It depends on blocks whose sync points it names, on those it follows, on one with its own id, on those
        that name it and must not find it yet, on a replacing block of its character, on blocks of its
        character that need the voice or the gaze as it does, and, if it is appended, on all blocks of its
        character. A replacing block depends on none of its character: it ends those that `replaced_by`
        returns. Blocks that must follow this one depend on it.
        """
        block = pending.block

        def is_predecessor(other: PendingBlock) -> bool:
            if other.block.id in pending.named or other.block.id == block.id:
                return True
            # A block that waits for the rest of a streamed speech may wait for long: nobody waits for it.
            is_incomplete = other.is_incomplete(other.block)
            if other.precedes(block.id) and not is_incomplete:
                return True
            if other.character != pending.character:
                return False
            if block.composition == "APPEND" or other.block.composition == "REPLACE":
                return True
            if other.block.id in block.interrupt or is_incomplete:
                return False
            return not pending.resources.isdisjoint(other.resources)

        replaces = block.composition == "REPLACE"
        earlier = [o for o in self.blocks if not (replaces and o.character == pending.character)]
        pending.predecessors.update(filter(is_predecessor, earlier))
        for other in self.blocks:
            is_successor = other.block.id in (*block.prepend_before, *block.chunk_before)
            if is_successor and other not in pending.all_predecessors:
                other.predecessors.add(pending)
        self.blocks.append(pending)

    def first_ready(self) -> PendingBlock | None:
        """Return the first block that is ready, or None. The caller removes it once it is planned."""
        return next((w for w in self.blocks if w.is_ready), None)

    def replaced_by(self, pending: PendingBlock) -> list[PendingBlock]:
        """Return the blocks of the same character that arrived before a replacing block."""
        earlier = self.blocks[: self.blocks.index(pending)]
        return [other for other in earlier if other.character == pending.character]

    def remove(self, blocks: Iterable[PendingBlock]) -> None:
        """Remove blocks. Other blocks no longer wait for them, and answers to their requests are ignored."""
        removed = set(blocks)
        self.blocks = [w for w in self.blocks if w not in removed]
        for pending in self.blocks:
            pending.predecessors -= removed
        for pending in removed:
            pending.requests.clear()


@dataclass(eq=False)
class _Request:
    """A request to a voice, of a whole speech or of a part of a long text."""

    pending: PendingBlock
    behaviour: str
    part: SpeechRequest  # what is requested now
    long_text: LongText | None
    utterance: Utterance | None = None  # what the block has of a long text so far


class TtsRequests:
    """The requests of a session to voices."""

    def __init__(self, manager: BlockManager, pending: PendingBlocks) -> None:
        self.fault: str | None = None  # why a voice failed last; None if none did
        self.request_count = 0  # how many requests were made; the id of the last one
        self._manager = manager
        self._pending = pending
        self._requests: dict[int, _Request] = {}

    def __len__(self) -> int:
        """Return the number of long texts of which a part is requested."""
        return sum(request.long_text is not None for request in self._requests.values())

    def request(
        self, pending: PendingBlock, requests: Mapping[str, SpeechRequest], voice: str | None
    ) -> list[Speak]:
        """Request the speech of a block; of a long text only the first clause.

        Args:
            requests: behaviour -> its speech.
            voice: the voice of requests that name none.
        """
        speaks = []
        for behaviour, request in requests.items():
            whole = replace(request, voice=request.voice or voice)
            long_text = LongText(whole) if is_long(whole) and not pending.final else None
            part = None if long_text is None else long_text.next()
            speaks.append(self._speak(_Request(pending, behaviour, part or whole, long_text)))
            pending.requests.add(self.request_count)
        return speaks

    def requested(self, pending: PendingBlock) -> list[str]:
        """Return the behaviours of a block that wait for their voice."""
        return [r.behaviour for id, r in self._requests.items() if id in pending.requests]

    def unfinished(self, pending: PendingBlock) -> set[str]:
        """Return the behaviours of a block whose texts are not complete."""
        requests = self._requests.values()
        return {r.behaviour for r in requests if r.pending is pending and r.long_text is not None}

    def answer(self, id: int, result: Utterance | RealizerError, t: float) -> list[Speak]:
        """Take the answer to a request. If the voice failed, the silent voice replaces it."""
        work.count(50)
        request = self._requests.pop(id, None)
        if request is None or (request.long_text is None and id not in request.pending.requests):
            return []
        pending, long_text = request.pending, request.long_text
        if not isinstance(result, Utterance):
            self.fault = str(result)
            try:
                result = silent_fallback(request.part, self.fault)
            except VoiceError:
                pending.requests.discard(id)  # the block is planned without this speech
                return []
        if pending.is_streaming and (long_text is None or long_text.is_complete):
            result = trim_final_pause(result)
        if long_text is None:
            pending.add_utterance(id, request.behaviour, result)
            return []
        if not self._extend(request, long_text, id, result, t) or (part := long_text.next()) is None:
            return []
        request.part = part
        return [self._speak(request)]

    def expire(self, t: float) -> list[Speak]:
        """Answer overdue requests with the silent voice, and return the next requests."""
        fault = VoiceError(f"the voice has not answered for {PATIENCE:g} s")
        late = [w for w in self._pending.blocks if w.waiting_since < t - PATIENCE]
        overdue = [id for pending in late for id in sorted(pending.requests)]
        return [speak for id in overdue for speak in self.answer(id, fault, t)]

    def deadline(self) -> float:
        """Return the time at which `expire` is due; infinity without requests."""
        return min((w.waiting_since + PATIENCE for w in self._pending.blocks if w.requests), default=math.inf)

    def _speak(self, request: _Request) -> Speak:
        self.request_count += 1
        self._requests[self.request_count] = request
        return Speak(self.request_count, request.part)

    def _extend(self, request: _Request, long_text: LongText, id: int, part: Utterance, t: float) -> bool:
        """Add a part of its text to a block. Return False if the block needs no more parts."""
        pending, behaviour, before = request.pending, request.behaviour, request.utterance
        if before is None:
            request.utterance = long_text.add_part(part)
            if id in pending.requests:
                pending.add_utterance(id, behaviour, request.utterance)
            return bool(pending.utterances)
        if pending in self._pending.blocks:
            if pending.utterances.get(behaviour) is not before:
                return False
            pending.utterances[behaviour] = request.utterance = long_text.add_part(part)
            return True
        block = pending.block.id
        playing = self._manager.blocks.find(block)
        if playing is None or playing.context.utterances.get(behaviour) is not before:
            return False
        times = playing.schedule.times.get(behaviour)
        if times is None:
            return False
        elapsed = t - playing.start - float(times[0])
        is_late = elapsed > long_text.ready_until - SOON
        request.utterance = long_text.add_part(part, elapsed + SOON if is_late else 0.0)
        if not self._manager.update_speech_timing(block, behaviour, request.utterance, t):
            return False
        # The warnings of earlier parts have been published.
        for fault in request.utterance.warnings[len(before.warnings) :]:
            warning = Warning(f"{block}:{behaviour}", "CUSTOM_ATTRIBUTE_NOT_SUPPORTED", f"speech: {fault}")
            self._manager.refuse(warning, playing.block.character_id)
        return True


def is_long(request: SpeechRequest) -> bool:
    """Whether a request should be synthesized in parts."""
    return request.seconds is None and request.recording is None and spoken_length(request.ssml) > SHORT
