"""Requests to voices for the speech of blocks; long texts are requested in parts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from realizer.core.errors import RealizerError, VoiceError
from realizer.playback.player import Player
from realizer.scheduling.timing import Warning
from realizer.server.documents.pending_blocks import Preparation, Waiting
from realizer.server.session.effects import Speak
from realizer.server.speech.long_text import Growing, shortened
from realizer.speech.duration_fit import silent_fallback
from realizer.speech.utterance import SpeechRequest, Utterance

# A voice that has not answered by then is taken for silent.
PATIENCE = 20.0  # s
# A part that comes too late for what is heard already follows so soon.
SOON = 0.05  # s


@dataclass(eq=False)
class _Text:
    """A long text, of which one part is ordered.

    Attributes:
        part: what was asked for last.
        given: what the block was given so far.
    """

    waiting: Waiting
    behaviour: str
    growing: Growing
    part: SpeechRequest
    given: Utterance | None = None


class Orders:
    """What the voices of a session are asked for.

    Attributes:
        fault: why a voice failed last; None where none did.
        placed: how many orders were given; the last one has this number.
    """

    def __init__(self, player: Player, preparation: Preparation) -> None:
        self.fault: str | None = None
        self._player = player
        self._preparation = preparation
        self.placed = 0
        self._texts: dict[int, _Text] = {}
        self._flowing: set[int] = set()  # what is a sentence only with the piece that follows

    def __len__(self) -> int:
        """Long texts of which a part is being said."""
        return len(self._texts)

    def place(self, waiting: Waiting, wants: Mapping[str, SpeechRequest]) -> list[Speak]:
        """Ask for what a block wants said, of a long text for its first clause.

        Args:
            wants: behaviour -> what it says, the voice chosen.
        """
        speaks = []
        for behaviour, say in wants.items():
            growing = Growing(say) if Growing.suits(say) and not waiting.final else None
            part = growing.next() if growing is not None else say
            speak = self._speak(part or say)
            waiting.says[speak.id] = (behaviour, speak.say)
            if waiting.flows:
                self._flowing.add(speak.id)
            if growing is not None:
                self._texts[speak.id] = _Text(waiting, behaviour, growing, speak.say)
            speaks.append(speak)
        return speaks

    def unfinished(self, waiting: Waiting) -> set[str]:
        """The behaviours of a block that are still being said."""
        return {text.behaviour for text in self._texts.values() if text.waiting is waiting}

    def answer(self, speak: int, result: Utterance | RealizerError, t: float) -> list[Speak]:
        """What a voice made; where it failed, the silent voice takes over.

        Returns:
            What to ask for now.
        """
        text = self._texts.pop(speak, None)
        flows = speak in self._flowing
        self._flowing.discard(speak)
        say = self._preparation.said(speak) if text is None else text.part
        if say is None:
            return []
        if not isinstance(result, Utterance):
            self.fault = str(result)
            try:
                result = silent_fallback(say, self.fault)
            except VoiceError:
                self._preparation.unspoken(speak)
                return []
        if flows and (text is None or text.growing.whole):
            result = shortened(result)
        if text is None:
            self._preparation.spoken(speak, result)
            return []
        if not self._grown(text, speak, result, t) or (part := text.growing.next()) is None:
            return []
        order = self._speak(part)
        text.part = order.say
        self._texts[order.id] = text
        if flows:
            self._flowing.add(order.id)
        return [order]

    def overdue(self, t: float) -> list[Speak]:
        """Take voices for silent that have not answered for too long."""
        fault = VoiceError(f"the voice has not answered for {PATIENCE:g} s")
        late = list(self._preparation.overdue(t - PATIENCE))
        return [speak for id in late for speak in self.answer(id, fault, t)]

    def deadline(self) -> float | None:
        """When `overdue` will have something."""
        return self._preparation.deadline(PATIENCE)

    def _speak(self, say: SpeechRequest) -> Speak:
        self.placed += 1
        return Speak(self.placed, say)

    def _grown(self, text: _Text, speak: int, part: Utterance, t: float) -> bool:
        """Give a block one more part of its text; False where it wants no more."""
        waiting, behaviour = text.waiting, text.behaviour
        before, block = text.given, waiting.block.id
        if before is None:
            text.given = text.growing.take(part)
            self._preparation.spoken(speak, text.given)
            return bool(waiting.utterances)
        if waiting in self._preparation.waiting:
            if waiting.utterances.get(behaviour) is not before:
                return False
            waiting.utterances[behaviour] = text.given = text.growing.take(part)
            return True
        playing = self._player.blocks.find(block)
        if playing is None or playing.context.utterances.get(behaviour) is not before:
            return False
        times = playing.schedule.times.get(behaviour)
        if times is None:
            return False
        heard = t - playing.start - float(times[0])
        text.given = text.growing.take(part, heard + SOON if heard > text.growing.made - SOON else 0.0)
        if not self._player.update_speech_timing(block, behaviour, text.given, t):
            return False
        # Planning has told what was said of the parts before.
        for fault in text.given.warnings[len(before.warnings) :]:
            warning = Warning(f"{block}:{behaviour}", "CUSTOM_ATTRIBUTE_NOT_SUPPORTED", f"speech: {fault}")
            self._player.refuse(warning, t, playing.block.character_id)
        return True
