"""Requests to voices for the speech of blocks; long texts are requested in parts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from realizer.core.errors import RealizerError, VoiceError
from realizer.playback.player import Player
from realizer.scheduling.timing import Warning
from realizer.server.documents.pending_blocks import PendingBlock, PendingBlocks
from realizer.server.session.effects import Speak
from realizer.server.speech.long_text import LongText, trim_final_pause
from realizer.speech.duration_fit import silent_fallback
from realizer.speech.utterance import SpeechRequest, Utterance

# The silent voice replaces one that has not answered by then.
PATIENCE = 20.0  # s
# A part of a long text that comes too late begins so much after the present.
SOON = 0.05  # s


@dataclass(eq=False)
class _Text:
    """A long text of which one part is requested.

    Attributes:
        part: the request.
        given: the utterance that the block has so far.
    """

    pending: PendingBlock
    behaviour: str
    long_text: LongText
    part: SpeechRequest
    given: Utterance | None = None


class TtsRequests:
    """The requests of a session to voices.

    Attributes:
        fault: why a voice failed last; None if none did.
        request_count: how many requests were made; the id of the last one.
    """

    def __init__(self, player: Player, preparation: PendingBlocks) -> None:
        self.fault: str | None = None
        self._player = player
        self._preparation = preparation
        self.request_count = 0
        self._texts: dict[int, _Text] = {}
        self._streaming: set[int] = set()  # requests for a part of a sentence

    def __len__(self) -> int:
        """Return the number of long texts of which a part is requested."""
        return len(self._texts)

    def request(self, pending: PendingBlock, requests: Mapping[str, SpeechRequest]) -> list[Speak]:
        """Request the speech of a block; of a long text only the first clause.

        Args:
            requests: behaviour -> its speech, with the voice chosen.
        """
        speaks = []
        for behaviour, request in requests.items():
            growing = LongText(request) if LongText.is_applicable(request) and not pending.final else None
            part = growing.next() if growing is not None else request
            speak = self._speak(part or request)
            pending.requests[speak.id] = (behaviour, speak.request)
            if pending.is_streaming:
                self._streaming.add(speak.id)
            if growing is not None:
                self._texts[speak.id] = _Text(pending, behaviour, growing, speak.request)
            speaks.append(speak)
        return speaks

    def unfinished(self, pending: PendingBlock) -> set[str]:
        """Return the behaviours of a block whose texts are not complete."""
        return {text.behaviour for text in self._texts.values() if text.pending is pending}

    def answer(self, speak: int, result: Utterance | RealizerError, t: float) -> list[Speak]:
        """Take the answer to a request. If the voice failed, the silent voice replaces it.

        Returns:
            The next requests.
        """
        text = self._texts.pop(speak, None)
        flows = speak in self._streaming
        self._streaming.discard(speak)
        request = self._preparation.request_of(speak) if text is None else text.part
        if request is None:
            return []
        if not isinstance(result, Utterance):
            self.fault = str(result)
            try:
                result = silent_fallback(request, self.fault)
            except VoiceError:
                self._preparation.give_up(speak)
                return []
        if flows and (text is None or text.long_text.is_complete):
            result = trim_final_pause(result)
        if text is None:
            self._preparation.add_utterance(speak, result)
            return []
        if not self._extend(text, speak, result, t) or (part := text.long_text.next()) is None:
            return []
        order = self._speak(part)
        text.part = order.request
        self._texts[order.id] = text
        if flows:
            self._streaming.add(order.id)
        return [order]

    def expire(self, t: float) -> list[Speak]:
        """Answer overdue requests with the silent voice, and return the next requests."""
        fault = VoiceError(f"the voice has not answered for {PATIENCE:g} s")
        late = list(self._preparation.overdue(t - PATIENCE))
        return [speak for id in late for speak in self.answer(id, fault, t)]

    def deadline(self) -> float | None:
        """Return the time at which `expire` is due; None without requests."""
        return self._preparation.deadline(PATIENCE)

    def _speak(self, request: SpeechRequest) -> Speak:
        self.request_count += 1
        return Speak(self.request_count, request)

    def _extend(self, text: _Text, speak: int, part: Utterance, t: float) -> bool:
        """Add a part of its text to a block. Return False if the block needs no more parts."""
        pending, behaviour = text.pending, text.behaviour
        before, block = text.given, pending.block.id
        if before is None:
            text.given = text.long_text.add_part(part)
            self._preparation.add_utterance(speak, text.given)
            return bool(pending.utterances)
        if pending in self._preparation.blocks:
            if pending.utterances.get(behaviour) is not before:
                return False
            pending.utterances[behaviour] = text.given = text.long_text.add_part(part)
            return True
        playing = self._player.blocks.find(block)
        if playing is None or playing.context.utterances.get(behaviour) is not before:
            return False
        times = playing.schedule.times.get(behaviour)
        if times is None:
            return False
        heard = t - playing.start - float(times[0])
        text.given = text.long_text.add_part(
            part, heard + SOON if heard > text.long_text.ready_until - SOON else 0.0
        )
        if not self._player.update_speech_timing(block, behaviour, text.given, t):
            return False
        # The warnings of earlier parts have been published.
        for fault in text.given.warnings[len(before.warnings) :]:
            warning = Warning(f"{block}:{behaviour}", "CUSTOM_ATTRIBUTE_NOT_SUPPORTED", f"speech: {fault}")
            self._player.refuse(warning, t, playing.block.character_id)
        return True
