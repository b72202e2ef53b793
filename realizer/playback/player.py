"""The player: manages blocks, reports their feedback and samples their faces.

It has no clock and no I/O: every call has the argument `now`, seconds on the session clock.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from bml_schema import Block, Feedback
from bml_schema.nodes import LANGUAGE
from realizer.animation.channel import Channel
from realizer.animation.frames import AUFrames
from realizer.animation.idle.idle_face import Idle
from realizer.animation.idle.prosody import AFTERMATH
from realizer.behaviours.kind import BehaviourKind, PlanningContext, Position
from realizer.behaviours.registry import KINDS
from realizer.core import work
from realizer.core.array_types import Float64, Int16
from realizer.core.options import DEFAULTS, PlayOptions
from realizer.expressions.library import library_of
from realizer.playback.block_manager import BlockManager
from realizer.playback.block_states import BlockEvent, State, next_state
from realizer.playback.character import RELAX, Cast, Character
from realizer.playback.face_motion import SEED_STEP, FaceMotion
from realizer.playback.scheduled_speech import ScheduledSpeech
from realizer.scheduling.timing import UNKNOWN, Schedule, Warning
from realizer.speech.utterance import Recording, SpeechRequest, Utterance
from realizer.tables.cooccurrence import Rules

# Frames up to this long before `now` can still be computed.
HISTORY = 1.0  # s


class Player:
    """The blocks of one session and their animation.

    Args:
        options: how documents are played. Face, mapping and frame rate are for the caller.
        kinds: tag -> BehaviourKind, the known behaviours.
        clips: id -> sound that documents can name as `clip:ID`; the caller may add some later.
        history: seconds before the last `due` for which frames can still be computed.
        face_inputs: index of a character -> the inputs of its face (`Face.inputs`); None if unknown.
        veto: (block, its schedule) -> why it is refused, or None.
        animates: False if blocks are only scheduled, and nothing is played.

    Attributes:
        manager: of its blocks; it has the commands to them that are not here.
        cast: the characters.
        blocks: the blocks, for reading only.
    """

    def __init__(
        self,
        options: PlayOptions = DEFAULTS,
        *,
        kinds: Mapping[str, BehaviourKind] = KINDS,
        clips: Mapping[str, Recording] | None = None,
        history: float = HISTORY,
        face_inputs: Callable[[int], Sequence[str]] | None = None,
        veto: Callable[[Block, Schedule], str | None] = lambda block, schedule: None,
        animates: bool = True,
    ) -> None:
        if not isinstance(options, PlayOptions):
            raise TypeError(f"options: wanted PlayOptions, got {options!r}")
        self.kinds = kinds
        self.cast = Cast()
        self.manager = BlockManager(kinds, self.cast, veto)
        self.blocks = self.manager.blocks
        self._timeline = self.manager.timeline
        self._face_inputs = face_inputs
        self.context = PlanningContext(
            scene=options.scene,
            seed=options.seed,
            language=options.language,
            jaw=options.jaw,
            lips=options.lips,
            media=options.media,
            clips={} if clips is None else clips,
            library=library_of(options.expressions),
            grace=options.grace,
            max_planning=options.max_planning,
            liveliness=options.liveliness if options.idle else 0.0,
            animates=animates,
        )
        self._faces = FaceMotion(options, self.blocks, self.cast)
        self.strict_bml = options.strict_bml
        self.history = history

    @property
    def version(self) -> int:
        """Increases whenever frames change that may have been computed before."""
        return self._timeline.version

    # documents ----------------------------------------------------------------------------------

    def speech_requests(self, block: Block) -> dict[str, SpeechRequest]:
        """Return {behaviour id: request to the voice}, whose results `submit` needs."""
        requests: dict[str, SpeechRequest] = {}
        language = block.unknown_attributes.get(LANGUAGE)
        context = replace(self.context, language=language) if language else self.context
        for node in work.counted(block.behaviours):
            kind = self.kinds.get(node.tag)
            request = None if kind is None else kind.speech_request
            if request is not None and (say := request(node, context)) is not None:
                requests[node.id] = say
        return requests

    def resources(self, block: Block) -> frozenset[str]:
        """Return what the behaviours of a block need that one behaviour at a time can have."""
        needed = set[str]()
        for node in block.behaviours:
            kind = self.kinds.get(node.tag)
            # A behaviour with a fault is dropped later, and may have no readable claims.
            if kind is not None and not any(fault.fatal for fault in kind.check(node, self.context)):
                needed |= kind.claims(node, self.context)
        return frozenset(needed)

    def submit(
        self,
        block: Block,
        now: float,
        utterances: Mapping[str, Utterance] | None = None,
        sender: int | None = None,
    ) -> Schedule:
        """Plan a block and play it as its composition says.

        Args:
            block: as parsed; its problems are reported with it.
            now: seconds on the session clock.
            utterances: the results of `speech_requests(block)`.
            sender: number of the connection that it came by.

        Returns:
            The schedule; `schedule.failed` if the whole block was refused. If it has `lengths`, more of the
            block fits with other utterances: submit it again with utterances of these lengths
            (`speech.duration_fit`), or with the same ones with a `stretch` of (1, 1).
        """
        character = self.cast.index_of(block.character_id)
        takes = (
            self.context.face_inputs if self._face_inputs is None else partial(self._face_inputs, character)
        )
        world = replace(self.context, utterances=dict(utterances or {}), face_inputs=takes, sender=sender)
        return self.manager.accept(block, world, now)

    def announce(self, block: Block, now: float) -> None:
        """Acknowledge a block, once: planning has begun. `submit` does it if it was not done before."""
        self.manager.announce(block, now)

    def refuse(self, warning: Warning, character: str | None = None) -> None:
        """Report why something was not accepted."""
        self.manager.refuse(warning, character)

    def stop(self, now: float, block_ids: Iterable[str] | None = None) -> list[str]:
        """End blocks, or all; return their ids. Sound fades, the face relaxes to its base without a jump."""
        return self.manager.stop(now, block_ids)

    def anticipate(self, id: str, syncs: Mapping[str, float], now: float) -> None:
        """Set the expected times of the points `anticipators:id:sync`, as `BlockManager.anticipate`."""
        self.manager.anticipate(id, syncs, now)

    def clear(self) -> None:
        """Forget all blocks; a player that is not used any more would leave them to the garbage collector."""
        self.blocks.clear()
        self._timeline.events.clear()

    def set_scene(self, scene: Mapping[str, Position] | None) -> None:
        """Set the positions of targets for documents that are planned from now on."""
        self.context = replace(self.context, scene=scene)

    def set_direct(self, values: Mapping[str, float | None], now: float, character: int = 0) -> None:
        """Hold AUs (0..1) and FAPs (FAPU) by name until they are changed; None releases one.

        Raises:
            KeyError: no such AU or FAP.
        """
        self.cast[character].set_direct(values, now)
        self._timeline.mark_changed()

    def hear(self, now: float, *, is_speaking: bool, text: str | None = None, character: int = 0) -> None:
        """Add the responses of a character to what another one says; it listens while the other still speaks.

        `text` is the next piece of what the other says, if it is known.
        """
        from realizer.behaviours.listen import responses  # few characters listen

        own = self.cast[character]
        context = replace(self.context, seed=self.context.seed + SEED_STEP * character)
        own.responses = responses(own.responses, now, context, is_speaking=is_speaking, text=text)
        self._timeline.mark_changed()

    def hear_sound(
        self, sound: Int16, rate: int, now: float, *, is_last: bool = False, character: int = 0
    ) -> None:
        """Add the responses of a character to the voice of another one.

        Args:
            sound: (n,) the next samples, mono; `rate` is in Hz.
            is_last: whether no more sound follows.
        """
        from realizer.speech.voice_activity import Turn, VoiceActivity

        own = self.cast[character]
        if own.heard is None or own.heard.rate != rate:
            own.heard = VoiceActivity(rate)
        turns = [*own.heard.add(sound), *(own.heard.end() if is_last else ())]
        if is_last:
            own.heard = None
        for turn in turns:
            text = "," if turn is Turn.PAUSES else None
            self.hear(now, is_speaking=turn is not Turn.ENDS, text=text, character=character)

    def direct_names(self, character: int = 0) -> tuple[str, ...]:
        """Return the names of the AUs and FAPs that are held directly, or have just been released."""
        return tuple(self.cast[character].direct)

    def set_emotion(self, values: Mapping[str, float], now: float, character: int = 0) -> None:
        """Hold an emotion, as AUs (0..1) and FAPs (FAPU) by name, instead of the previous one; {} for none.

        Its layer is that of expressions, below speech, gaze and direct values, in whatever order they are
        set.

        Raises:
            KeyError: no such AU or FAP.
        """
        self.cast[character].set_emotion(values, now)
        self._timeline.mark_changed()

    # feedback -----------------------------------------------------------------------------------

    def due(self, now: float, starts_before: float = float("inf")) -> list[Feedback]:
        """Return feedback that is due, in the order of report, each message once.

        Blocks that start at `starts_before` or later do not start yet.
        """
        forgettable = now - self.history - RELAX - AFTERMATH
        if not (self.next_event <= now or self.blocks.first_invisible < forgettable or self.manager.reports):
            return []
        self.manager.advance(now, starts_before)
        out = self.manager.reports.take_all()
        if forgotten := self.blocks.forget(forgettable):
            for playing in forgotten:
                self._timeline.events.drop(playing)
            for index, character in enumerate(self.cast):
                # The mood at the start of a speech shows in the motion of the head until its end.
                spoken = (s.start for p in self.blocks.of_character(index) for s in p.speech.values())
                character.forget(min([now, *spoken]) - self.history)
        return out

    @property
    def next_event(self) -> float:
        """The time of the next event of a block, which may change frames after it; infinite for never."""
        due = self._timeline.events.next
        return float("inf") if due is None else due

    def next_deadline(self) -> float | None:
        """Return when `due` next returns something; None if nothing plays or waits; past for at once."""
        return self.manager.next_deadline()

    def next_change(self) -> float:
        """Return when `due` will next report or forget something; infinite for never."""
        first = self.next_deadline()
        forgets = self.blocks.first_invisible + self.history + RELAX + AFTERMATH
        return forgets if first is None else min(first, forgets)

    # state --------------------------------------------------------------------------------------

    def restore(self, characters: Iterable[Character], past: Iterable[Schedule], expected: Schedule) -> None:
        """Restore the state of another player that was idle; `past`, `expected`: as of `blocks.snapshot`."""
        self.cast[:] = characters
        self.blocks.restore(past, expected)
        self._timeline.mark_changed()

    # frames -------------------------------------------------------------------------------------

    @property
    def characters(self) -> list[str | None]:
        """Ids of the characters; the first is the default of documents without characterId."""
        return self.cast.ids

    @property
    def rules(self) -> Rules | None:
        """The rules of co-occurrence, None if there are none."""
        return self._faces.rules

    def frames(self, times: Float64, character: int = 0) -> AUFrames:
        """Return the frames of a face at any times; a pure function of what was submitted, live and offline.

        Args:
            times: (n,) float64 seconds on the session clock, rising; at most `history` before the last `due`.
        """
        return self._faces.frames(times, character)

    def motion(self, times: Float64, character: int = 0) -> tuple[list[Channel], Idle | None]:
        """Return all channels that move a face at these times (at least one), and its idle motion."""
        return self._faces.channels(times, character)

    @property
    def end(self) -> float:
        """When the last block has ended, and relaxed if it was cut off; 0 without blocks."""
        return max((p.invisible_after for p in self.blocks.all() if p.end < float("inf")), default=0.0)

    def speech(self) -> tuple[ScheduledSpeech, ...]:
        """Return past and future utterances, in order of their start."""
        heard = (s for p in self.blocks.all() for s in p.speech.values() if s.is_heard)
        return tuple(sorted(heard, key=lambda s: s.start))

    def latest(self, schedule: Schedule) -> Schedule:
        """Return the present schedule of a block, given the one that `submit` returned."""
        return self.blocks.latest(schedule)

    def state(self, now: float) -> dict[str, Any]:
        """Return the playing blocks, the visible AUs and the values of each layer, as plain data."""
        blocks: list[dict[str, Any]] = []
        for p in self.blocks.active():
            if p.end <= now:
                continue
            starts = p.state is State.LURKING and p.start <= now
            status = next_state(p.state, BlockEvent.START) if starts else p.state
            blocks.append({"id": p.block.id, "character": p.block.character_id, "status": status.value})
            if waits := [wait.block.block.id for wait in p.dependencies if p.is_waiting]:
                blocks[-1]["waits_for"] = waits
            if p.has_known_start:
                end = p.end if p.schedule.duration < UNKNOWN else None
                blocks[-1] |= {"start": p.start, "end": end}
                spans = ((b, t + p.start) for b, t in p.schedule.times.items() if len(t))
                blocks[-1]["behaviours"] = [b for b, t in spans if t[0] <= now < t[-1]]
        faces = [self._faces.state(now, index) for index in range(len(self.cast))]
        return {"time": now, "blocks": blocks, "characters": faces}
