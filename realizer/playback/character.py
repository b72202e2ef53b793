"""One character of a session: base states and direct values, as channels."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from realizer.animation.axis import axis, region
from realizer.animation.channel import Channel, Layer
from realizer.animation.curves import sample, weights
from realizer.core import work

if TYPE_CHECKING:
    from realizer.speech.voice_activity import VoiceActivity

# Duration of the return to the base face after a release; about that of an expression.
RELAX = 0.3  # s
# A directly set AU or FAP is reached this long after it was set.
SETTLE = 0.12  # s


@dataclass(frozen=True, eq=False)
class BaseShift:
    """A change of a base state: from `begin` to `end` it replaces the base of its regions."""

    begin: float
    end: float
    regions: frozenset[str]
    channels: tuple[Channel, ...]

    @classmethod
    def of(cls, begin: float, end: float, own_region: str, channels: tuple[Channel, ...]) -> BaseShift:
        """Return a shift of one region, and of every other region that its channels move."""
        return cls(begin, end, frozenset({own_region, *(region(c.target) for c in channels)}), channels)


@dataclass(eq=False)
class Character:
    """The state of a face outside any block."""

    id: str | None
    shifts: list[BaseShift] = field(default_factory=list)
    direct: dict[str, Channel] = field(default_factory=dict)
    emotion: dict[str, Channel] = field(default_factory=dict)
    responses: list[Channel] = field(default_factory=list)
    # the voice of another one that the character hears, if its sound is sent
    heard: VoiceActivity | None = None

    def add_shifts(self, shifts: Collection[BaseShift]) -> None:
        self.shifts = sorted([*self.shifts, *shifts], key=lambda s: (s.begin, s.end))

    def replace_shifts(self, old: Mapping[str, BaseShift], new: Mapping[str, BaseShift]) -> None:
        replacements = {id(old[name]): shift for name, shift in new.items()}
        shifts = [replacements.get(id(s), s) for s in self.shifts]
        self.shifts = sorted(shifts, key=lambda s: (s.begin, s.end))

    def cancel(self, shifts: Collection[BaseShift], now: float) -> None:
        """Drop those of `shifts` that have not begun; the others continue to their end."""
        gone = {id(s) for s in shifts if s.begin >= now}
        self.shifts = [s for s in self.shifts if id(s) not in gone]

    def set_direct(self, values: Mapping[str, float | None], now: float) -> None:
        """Hold AUs (0..1) and FAPs (FAPU) by name; None releases one. A KeyError changes nothing."""
        _hold(self.direct, values, now, Layer.DIRECT, SETTLE)

    def set_emotion(self, values: Mapping[str, float], now: float) -> None:
        """Hold an emotion instead of the previous one: AUs (0..1) and FAPs (FAPU) by name; {} for none.

        Its layer is that of expressions, below mood, speech, gaze and direct values. A KeyError changes
        nothing.
        """
        changes = dict.fromkeys(self.emotion) | dict(values)
        _hold(self.emotion, changes, now, Layer.EXPRESSION, RELAX)

    def channels(self) -> list[Channel]:
        """Return base states, each until the next shift of its region, and direct values."""
        out: list[Channel] = []
        successors: dict[str, BaseShift] = {}  # of each region
        for shift in work.counted(self.shifts[::-1], 3):
            for channel in shift.channels[::-1]:
                successor = successors.get(region(channel.target))
                out.append(channel if successor is None else channel.faded(successor.begin, successor.end))
            successors |= dict.fromkeys(shift.regions, shift)
        return [*out[::-1], *self.responses, *self.emotion.values(), *self.direct.values()]

    def forget(self, before: float) -> None:
        """Drop channels that are invisible after `before`, so that the cost does not grow with time."""
        left: list[BaseShift] = []
        replacing: set[frozenset[str]] = set()  # the regions of later shifts that have ended
        for shift in work.counted(self.shifts[::-1]):
            if not any(shift.regions <= regions for regions in replacing):
                left.append(shift)
            if shift.end < before:
                replacing.add(shift.regions)
        self.shifts = left[::-1]
        self.direct = {n: c for n, c in self.direct.items() if c.faded_at > before}
        self.emotion = {n: c for n, c in self.emotion.items() if c.faded_at > before}
        self.responses = [c for c in self.responses if c.span[1] > before]


class Cast(list[Character]):
    """The characters of a session; the first one is meant where a document names none."""

    def __init__(self) -> None:
        super().__init__([Character(None)])

    @property
    def ids(self) -> list[str | None]:
        return [character.id for character in self]

    def index_of(self, id: str | None) -> int:
        """Return the index of a character, 0 for None; a new one is added."""
        if id is None:
            return 0
        if id not in self.ids and self[0].id is None:
            self[0].id = id  # the first name in a session is the name of its first face
        elif id not in self.ids:
            self.append(Character(id))
        return self.ids.index(id)

    def drop_new(self, ids: Sequence[str | None]) -> None:
        """Drop the characters that a former list of ids does not have, and a later name of the first one."""
        del self[len(ids) :]
        self[0].id = ids[0]


def _hold(
    channels: dict[str, Channel], values: Mapping[str, float | None], now: float, layer: Layer, rise: float
) -> None:
    """Move channels to these values within `rise` seconds, in place; None fades one out."""
    columns = axis()
    targets = {name: columns[name] for name in values}
    for name, value in values.items():
        old = channels.get(name)
        if value is None:
            if old is not None:
                channels[name] = old.faded(now, now + RELAX)
            continue
        before = share = 0.0
        if old is not None:
            at = np.array([now])
            before, share = float(sample([old], at)[0, 0]), float(weights([old], at)[0, 0])
        keys, ends = np.array([now, now + rise]), np.array([before, value])
        weight = np.array([share, 1.0])
        channels[name] = Channel(
            targets[name], keys, ends, layer=layer, keeps_last=True, weight=weight, source="set"
        )
