"""The motion of a session's faces: of blocks, base states, direct values, speech and idle."""

from collections.abc import Callable, Iterator, Sequence
from functools import cache, partial
from typing import Any

import numpy as np

from realizer.animation.axis import AU_NAMES, axis
from realizer.animation.blend import blend
from realizer.animation.channel import Channel, Layer
from realizer.animation.frames import AUFrames
from realizer.animation.idle.blinks import gaze_shifts
from realizer.animation.idle.idle_face import Idle, idle_face
from realizer.animation.idle.prosody import KnownMotion, SpeechSpan, phrase_ends, prosody_channels
from realizer.animation.lips.lip_sync import opened
from realizer.animation.speaking_style import Style, on_style, style_of
from realizer.core import work
from realizer.core.array_types import Float64
from realizer.core.options import PlayOptions
from realizer.playback.active_block import ActiveBlock
from realizer.playback.block_store import BlockStore
from realizer.playback.character import Character
from realizer.tables.cooccurrence import load_rules

SEED_STEP = 7919  # from the seed of one character to that of the next
# Motion that accompanies speech is at most this far from it.
NEAR = 5.0  # s


class FaceMotion:
    """The motion of a session's faces; `rules` of co-occurrence are None if there are none."""

    def __init__(self, options: PlayOptions, blocks: BlockStore, characters: Sequence[Character]) -> None:
        self.rules = load_rules(options.cooccurrence)
        self._options = options
        self._blocks = blocks
        self._characters = characters

    def frames(self, times: Float64, character: int = 0) -> AUFrames:
        """Return frames; see `Player.frames`."""
        times = np.asarray(times, np.float64)
        if not len(times):
            return blend([], times, self.rules)
        channels, idle = self.channels(times, character)
        return blend(channels, times, self.rules, idle)

    def channels(self, times: Float64, character: int = 0) -> tuple[list[Channel], Idle | None]:
        """Return all channels that move a face at these times (at least one), and its idle motion."""
        first, last = float(times[0]), float(times[-1])
        blocks = self._blocks.of_character(character)
        own = self._characters[character].channels()
        moods = [channel for channel in work.counted(own) if channel.layer is Layer.BASE]

        @cache
        def on_styles(playing: ActiveBlock) -> list[Channel]:
            return on_style((*playing.moving_channels(), *moods))

        @cache  # the head and the mouth have the same style
        def style(playing: ActiveBlock, start: float) -> Style:
            return style_of(on_styles(playing), start)

        channels = [c for p in blocks for c in _with_feeling(p, partial(style, p), first, last)] + own
        if not self._options.idle:
            return channels, None
        seed = self._options.seed + SEED_STEP * character
        talks = [
            (SpeechSpan(s.start + at, s.until, part), p)
            for p in (blocks if self._options.prosody else ())
            for s in p.speech.values()
            if s.is_heard
            for at, part in s.utterance.sections or [(0.0, s.utterance)]
        ]
        near = [
            t._replace(style=partial(style, p, t.start))
            for t, p in talks
            if t.start - NEAR <= last and t.start + t.utterance.duration + NEAR >= first
        ]
        if near:
            known = [motion for p in blocks for motion in work.counted(p.known_motions())]
            known += [KnownMotion(c.span[0], c) for c in work.counted(own)]
            channels += prosody_channels(near, first, last, seed, known)
        shifts = gaze_shifts(channels, first, last) if self._options.liveliness else ()
        ends = phrase_ends(talk for talk, _ in talks)
        return channels, idle_face(
            first, last, seed, ends, liveliness=self._options.liveliness, shifts=shifts
        )

    def state(self, now: float, character: int) -> dict[str, Any]:
        """Return the visible AUs of a face and the values of each layer, as plain data."""
        times = np.array([now])
        channels, idle = self.channels(times, character)
        fap_names = list(axis())[len(AU_NAMES()) : len(AU_NAMES()) + 68]
        layers = {}
        for layer in Layer:
            alone = idle if layer is Layer.IDLE else None
            own = blend([c for c in channels if c.layer is layer], times, idle=alone)
            # AUs below 0.005 and FAPs below half a unit are invisible.
            values = zip(fap_names, own.faps[0].tolist(), strict=True)
            faps = {name: round(value) for name, value in values if abs(value) >= 0.5}
            if (aus := _up(own)) or faps:
                layers[layer.name.lower()] = {"aus": aus, "faps": faps}
        visible = _up(blend(channels, times, self.rules, idle))
        return {"character": self._characters[character].id, "aus": visible, "layers": layers}


def _with_feeling(
    playing: ActiveBlock, style: Callable[[float], Style], first: float, last: float
) -> Iterator[Channel]:
    """Yield the channels of a block; the lips of speech near these times open by what the face shows."""
    for behaviour, channels in work.counted(playing.channels.items()):
        speech = playing.speech.get(behaviour)
        if speech is not None and channels and channels[0].span[0] <= last and channels[0].span[1] >= first:
            channels = opened(channels, style(speech.start).opening)
        yield from channels


def _up(frames: AUFrames) -> dict[str, float]:
    values = zip(AU_NAMES(), frames.aus[0].tolist(), strict=True)
    return {name: round(value, 3) for name, value in values if value > 0.005}
