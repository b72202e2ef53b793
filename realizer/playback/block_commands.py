"""Commands of behaviours to other blocks: interrupt, activate, change a parameter."""

from __future__ import annotations

from typing import Protocol

from realizer.animation.channel import Gain
from realizer.behaviours.kind import Activate, BlockCommand, Change, Interrupt
from realizer.playback.active_block import ActiveBlock
from realizer.playback.timeline import BlockTimeline

# Duration of an instant change of a face and of a sound, which avoids jumps and clicks.
AT_ONCE = {False: 0.1, True: 0.02}  # s


class Blocks(Protocol):
    """The blocks of a session, as far as commands need them."""

    timeline: BlockTimeline

    def activate(self, id: str, now: float) -> bool: ...

    def revoke(self, id: str, now: float) -> bool: ...

    def has_seen(self, id: str) -> bool: ...


class CommandError(Exception):
    """A command that cannot be executed; the message has the expected and the actual value."""


def execute(blocks: Blocks, playing: ActiveBlock, behaviour: str, act: BlockCommand, now: float) -> None:
    """Execute the command of a behaviour of a playing block.

    Raises:
        CommandError: it cannot be executed.
    """
    match act:
        case Interrupt():
            _interrupt(blocks, act, now)
        case Activate(block):
            if not blocks.activate(block, now):
                raise CommandError(f"target: wanted a block that was preplanned and waits, got {block!r}")
        case Change():
            until = playing.start + float(playing.schedule.times[behaviour][-1])
            _change(blocks, act, now, until)


def _interrupt(blocks: Blocks, act: Interrupt, now: float) -> None:
    target = blocks.timeline.blocks.find(act.block)
    if target is None:
        if not blocks.revoke(act.block, now) and not blocks.has_seen(act.block):
            raise CommandError(f"target: wanted a block, got {act.block!r}, of which nothing was heard")
        return
    named = set(target.schedule.times)
    if act.include is not None and (strange := act.include - named):
        raise CommandError(f"include: no behaviour {sorted(strange)[0]!r} plays in {act.block}")
    chosen = (named if act.include is None else act.include) - act.exclude
    left = target.unfinished(now)
    if (act.include is None and not act.exclude) or (left and left <= chosen):
        blocks.timeline.stop(target, now)
    elif left & chosen:
        blocks.timeline.cut(target, left & chosen, now)


def _change(blocks: Blocks, act: Change, now: float, until: float) -> None:
    target = blocks.timeline.blocks.find(act.block)
    if target is None or act.behaviour not in target.unfinished(now) or not target.has_begun:
        raise CommandError(f"target: wanted a behaviour that plays, got {act.block}:{act.behaviour}")
    node = target.block[act.behaviour]
    known = target.kinds[node.tag].parameters
    if act.parameter not in known:
        names = ", ".join(sorted(known)) or "none"
        raise CommandError(f"paramId: {act.block}:{act.behaviour} has {names}, got {act.parameter!r}")
    usual = known[act.parameter]
    unscaled = float(getattr(node, usual) if isinstance(usual, str) else usual)
    if unscaled <= 0.0:
        raise CommandError(
            f"{act.parameter}: wanted one that was above 0, got {act.block}:{act.behaviour} at 0"
        )
    sound = act.parameter == "volume"
    if act.to < 0 or (act.initial or 0) < 0:
        raise CommandError(f"{act.parameter}: wanted 0 or more, got {min(act.to, act.initial or 0):g}")
    reached = now + AT_ONCE[sound]
    gains = [] if act.initial is None else [Gain(now, reached, act.initial / unscaled)]
    if act.curve is None or until <= reached:
        gains = [Gain(now, reached, act.to / unscaled)]
    else:
        gains.append(Gain(reached if gains else now, until, act.to / unscaled, act.curve))
    target.scale(act.behaviour, gains, sound=sound)
    blocks.timeline.mark_changed()
